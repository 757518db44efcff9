"""The commands with their options and arguments, and the most that there may be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import typer.main

from roboirg.main import app

MOST_ENTRIES = 19
MOST_COMMANDS = 31
MOST_PARAMETERS = 154
"""What a reader can find their way in: entries of ``roboirg --help``, commands in all, options and
arguments in all."""


class CommandCount(NamedTuple):
    """A command and the names of its options and arguments, ``--help`` left out."""

    words: str
    parameters: tuple[str, ...]


def commands() -> tuple[CommandCount, ...]:
    """Return all commands; the first, without words, has the options of ``roboirg`` itself."""
    return tuple(_walk(typer.main.get_command(app), ()))


def entries() -> int:
    """Return the number of commands and groups of ``roboirg --help``."""
    return len(getattr(typer.main.get_command(app), "commands", {}))


def _walk(command: Any, words: tuple[str, ...]) -> Iterator[CommandCount]:
    group = getattr(command, "commands", {})
    if not group or not words:
        parameters = [parameter for parameter in command.params if parameter.name != "help"]
        names = tuple(parameter.opts[0] for parameter in parameters)
        yield CommandCount(" ".join(words), names)
    for name, inner in sorted(group.items()):
        yield from _walk(inner, (*words, name))
