"""The recipes of a page of the documentation, installed as a package of their own."""

import re
import tomllib
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def install(folder, page, group="", more=""):
    """Install the Python files of a page and the entry points of a group, or of all groups.

    `more` is added to the entry points.
    """
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    for name, code in re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text, flags=re.DOTALL):
        (folder / name).write_text(code)
    lines = []
    for block in re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL):
        for named, entries in tomllib.loads(block)["project"]["entry-points"].items():
            if group in named:
                lines += [f"[{named}]", *map(" = ".join, entries.items())]
    info = folder / f"{page}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {page}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("\n".join([*lines, more]))
