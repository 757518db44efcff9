"""The package's layout, read from its imports.

A room is a folder or module at the top of `src/roboirg`; an arrow says that one room imports
another, at any level of nesting. Inside a room, an import runs back up where folders or files
import each other in a circle. ``python scripts/layout.py`` writes the table of rooms in
docs/architecture.md.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

from written_parts import table, with_part

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "roboirg"
PAGE = ROOT / "docs" / "architecture.md"
APPS = "roboirg.apps"
GROUND = ("core", "util")
"""What all rooms may import."""
FACE = ("roboirg", "__main__")
"""What only hands on: the package's own file, and ``python -m roboirg``."""

Graph = Mapping[str, Iterable[str]]


class Import(NamedTuple):
    """One import of a module of the package by another one."""

    source: str
    target: str


def module_name(path: Path) -> str:
    """Return the dotted name of a file of the package."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


@cache
def modules() -> Mapping[str, Path]:
    """Return the files of the package by their dotted names."""
    return {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


@cache
def tree(path: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imported_names(path: Path) -> Iterator[str]:
    """Yield the dotted name of all that a file imports, inside functions, too."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in modules() else str(node.module)


@cache
def imports() -> tuple[Import, ...]:
    """Return every import of one file of the package by another one."""
    found = []
    for source, path in modules().items():
        for target in imported_names(path):
            if target in modules() and target != source:
                found.append(Import(source, target))
    return tuple(found)


def room_of(module: str, folder: str = PACKAGE.name) -> str:
    """Return the file or folder directly in a folder, or in the package, that holds a module."""
    return module.removeprefix(f"{folder}.").partition(".")[0]


@cache
def arrows(folder: str = PACKAGE.name) -> Mapping[str, Mapping[str, Import]]:
    """Return what each room imports of the others, with an example of such an import.

    Args:
        folder: the package, or one inside it, whose files and folders are its rooms.
    """
    inside = [module for module in modules() if _within(module, folder)]
    found: dict[str, dict[str, Import]] = {room_of(module, folder): {} for module in inside}
    for item in imports():
        if item.source in inside and item.target in inside:
            source = room_of(item.source, folder)
            target = room_of(item.target, folder)
            if source != target:
                found[source].setdefault(target, item)
    return found


def circles(graph: Graph) -> list[list[str]]:
    """Return a circle of nodes that reach each other, if there is any."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return [error.args[1]]
    return []


def imports_back_up() -> list[str]:
    """Return imports inside a room that close a circle between its folders and files."""
    found = []
    for folder, path in modules().items():
        if path.name != "__init__.py" or path.parent == PACKAGE:
            continue
        graph = arrows(folder)
        for circle in circles(graph):
            for target, source in itertools.pairwise(circle):
                item = graph[source][target]
                found.append(f"{folder}: {item.source} imports {item.target}")
    return found


def _within(module: str, folder: str) -> bool:
    return module == folder or module.startswith(f"{folder}.")


def importers_of_applications() -> set[str]:
    """Return the modules outside the applications that import one of them."""
    of_applications = [item.source for item in imports() if _within(item.target, APPS)]
    return {module for module in of_applications if not _within(module, APPS)}


def imports_between_applications() -> list[Import]:
    """Return the imports of one application by another."""
    found: list[Import] = []
    for others in arrows(APPS).values():
        found += others.values()
    return found


def rooms_by_layer() -> str:
    """Return a table of the rooms, each in a layer above all that it imports.

    Imports that a longer way implies are left out, as are those of `GROUND`.
    """
    graph = {}
    for room, others in arrows().items():
        if room not in (*GROUND, *FACE):
            graph[room] = set(others) - set(GROUND)
    sorter = TopologicalSorter(graph)
    sorter.prepare()
    reached: dict[str, set[str]] = {}
    rows: list[tuple[object, ...]] = [(0, _quoted(GROUND), "")]
    for layer in itertools.count(1):
        ready = sorted(sorter.get_ready(), reverse=True)
        if not ready:
            break
        for room in ready:
            implied = set()
            for other in graph[room]:
                implied |= reached[other]
            reached[room] = graph[room] | implied
            rows.append((layer, _quoted([room]), _quoted(graph[room] - implied)))
        sorter.done(*ready)
    return table(("layer", "room", "imports"), reversed(rows))


def _quoted(rooms: Iterable[str]) -> str:
    return ", ".join(f"`{room}`" for room in sorted(rooms))


def page_text() -> str:
    """Return the page with the table of rooms."""
    return with_part(PAGE.read_text(encoding="utf-8"), "rooms", rooms_by_layer())


if __name__ == "__main__":
    PAGE.write_text(page_text(), encoding="utf-8")
