"""The package's layout, read from its imports.

A room is a folder or module at the top of `src/roboirg`; an arrow says that one room imports
another, at any level of nesting. Inside a room, an import runs back up where folders or files
import each other in a circle. `scripts/draw_layout.py` draws the rooms.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "roboirg"
APPS = "roboirg.apps"

Graph = Mapping[str, Iterable[str]]


class Import(NamedTuple):
    """One import of a module of the package by another one."""

    source: str
    target: str


def module_name(path: Path) -> str:
    """Return the dotted name of a file of the package."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


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
    package = module_name(path.parent / "__init__.py")
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parts = package.split(".")
                parent = parts[: len(parts) - node.level + 1]
                base = ".".join([*parent, *filter(None, [base])])
            for alias in node.names:
                name = f"{base}.{alias.name}"
                yield name if name in modules() else base


@cache
def imports() -> tuple[Import, ...]:
    """Return every import of one file of the package by another one, each once."""
    found = {
        Import(source, target): None
        for source, path in modules().items()
        for target in imported_names(path)
        if target in modules() and target != source
    }
    return tuple(found)


def room_of(module: str) -> str:
    """Return the folder or module at the top of the package that holds a module."""
    return module.split(".")[1] if "." in module else module


@cache
def arrows() -> Mapping[str, Mapping[str, Import]]:
    """Return the rooms that each room imports, with an example of such an import."""
    found: dict[str, dict[str, Import]] = {room_of(module): {} for module in modules()}
    for one in imports():
        source, target = room_of(one.source), room_of(one.target)
        if source != target:
            found[source].setdefault(target, one)
    return found


def circles(graph: Graph) -> list[list[str]]:
    """Return the groups of nodes that reach each other (Tarjan's algorithm)."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        number[node] = lowest[node] = len(number)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in number:
                visit(other)
            if other in stack:
                lowest[node] = min(lowest[node], lowest[other])
        if lowest[node] == number[node]:
            group = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(group) > 1:
                found.append(sorted(group))

    for node in graph:
        if node not in number:
            visit(node)
    return found


def file_circles() -> list[list[str]]:
    """Return the groups of files that import each other in a circle."""
    graph: dict[str, list[str]] = defaultdict(list)
    for one in imports():
        graph[one.source].append(one.target)
    return circles(graph)


def imports_back_up() -> list[str]:
    """Return the imports inside a room that close a circle between its folders and files."""
    folders = [name for name, path in modules().items() if path.name == "__init__.py"]
    found: list[str] = []
    for folder in folders:
        if folder == PACKAGE.name:
            continue
        inside = [one for one in imports() if _within(one.source, folder)]
        graph: dict[str, dict[str, list[Import]]] = defaultdict(lambda: defaultdict(list))
        for one in inside:
            if _within(one.target, folder):
                source, target = _child(one.source, folder), _child(one.target, folder)
                if source != target:
                    graph[source][target].append(one)
        for group in circles(graph):
            found += [
                f"{folder}: {one.source} imports {one.target}"
                for source in group
                for target in group
                for one in graph[source].get(target, ())
            ]
    return found


def _within(module: str, folder: str) -> bool:
    return module == folder or module.startswith(f"{folder}.")


def _child(module: str, folder: str) -> str:
    """Return the file or folder directly in a folder that holds a module."""
    return module[len(folder) + 1 :].split(".", maxsplit=1)[0] or "__init__"


def importers_of_applications() -> set[str]:
    """Return the modules outside the applications that import one of them."""
    return {
        one.source
        for one in imports()
        if _within(one.target, APPS) and not _within(one.source, APPS)
    }


def imports_between_applications() -> list[Import]:
    """Return the imports of one application by another."""
    return [
        one
        for one in imports()
        if _within(one.source, APPS)
        and _within(one.target, APPS)
        and _child(one.source, APPS) != _child(one.target, APPS)
    ]


def floors(graph: Graph) -> dict[str, int]:
    """Return the floor of each node: above all that it reaches; 0 for what imports nothing."""
    found: dict[str, int] = {}

    def floor(node: str) -> int:
        if node not in found:
            found[node] = 1 + max((floor(other) for other in graph.get(node, ())), default=-1)
        return found[node]

    for node in graph:
        floor(node)
    return found
