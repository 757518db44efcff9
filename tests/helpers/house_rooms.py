"""The files of the house, by room."""

from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "roboirg"
PACKAGES = sorted(path.parent for path in (ROOT / "packages").glob("*/pyproject.toml"))
SOURCES = sorted(PACKAGE.rglob("*.py"))
"""The benchmark's own files."""
TESTS = [ROOT / "conftest.py", *sorted((ROOT / "tests").rglob("*.py"))]
TESTS += [path for package in PACKAGES for path in sorted(package.rglob("tests/**/*.py"))]
WITH_SMALLER_ONES = ("analysis", "apps", "policies", "runs")
"""Rooms whose folders have ceilings of their own."""


def house_files():
    """Return the files of each room, or of the smaller ones in it."""
    rooms = defaultdict(list)
    for path in SOURCES:
        inside = path.relative_to(PACKAGE).parts
        depth = 2 if inside[0] in WITH_SMALLER_ONES and len(inside) > 2 else 1
        rooms["/".join(inside[:depth]) if len(inside) > 1 else "top"].append(path)
    for name in ("packages", "integrations"):
        for path in sorted({*(ROOT / name).rglob("*.py")} - {*TESTS}):
            rooms[f"{name}/{path.relative_to(ROOT / name).parts[0]}"].append(path)
    return rooms
