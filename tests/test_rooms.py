"""The top-level rooms of the package import each other without circles."""

import ast
import functools
from graphlib import TopologicalSorter
from pathlib import Path

import roboirg

PACKAGE = Path(roboirg.__file__).parent


@functools.cache
def imported_rooms(path):
    """Return the rooms that a file imports, at any level of nesting."""
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module == "roboirg":
            names += [f"roboirg.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names.append(node.module)
    rooms = {tuple(name.split(".")[:2]) for name in names if name.split(".")[0] == "roboirg"}
    return {room[1] if len(room) > 1 else "__init__" for room in rooms}


def test_rooms_import_each_other_without_circles():
    imports = {}
    for path in PACKAGE.rglob("*.py"):
        room = path.relative_to(PACKAGE).with_suffix("").parts[0]
        imports.setdefault(room, set()).update(imported_rooms(path) - {room})
    assert set().union(*imports.values()) <= set(imports)
    tuple(TopologicalSorter(imports).static_order())


def test_only_the_package_itself_imports_from_its_root():
    importing = {path.name for path in PACKAGE.rglob("*.py") if "__init__" in imported_rooms(path)}
    assert importing == set()
