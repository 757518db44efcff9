"""The recipes of docs/add-protocol.md, installed as packages of their own."""

import re
import tomllib
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs" / "add-protocol.md").read_text(encoding="utf-8")


def fenced(language, word):
    """Return the block of the page that has a word."""
    blocks = re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)
    return next(block for block in blocks if word in block)


def install(folder, module, code, entries, more=""):
    """Install the blocks with these words as a package; `more` is added to its entry points."""
    (folder / f"{module}.py").write_text(fenced("python", code))
    ((group, names),) = tomllib.loads(fenced("toml", entries))["project"]["entry-points"].items()
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    lines = [f"{name} = {value}\n" for name, value in names.items()]
    (info / "entry_points.txt").write_text(f"[{group}]\n{''.join(lines)}{more}")
