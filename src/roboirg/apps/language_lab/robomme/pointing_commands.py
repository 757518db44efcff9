"""Commands of their own for referring expressions, where no phrase gives way to one.

*Repeatedly* gives once away, and *just as often* after *the cube that was picked up* would say how
often it was picked up before.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

from roboirg.language.worded_command import WordedCommand

_REPEATEDLY = re.compile(r"\b(?:repeatedly|over and over) ", re.IGNORECASE)
_RELATIVE_CLAUSE = re.compile(
    r"(?P<clause>\b(?:that|which) (?:was|were|is|are|has|have|had)\b[^,;.{}]*) (?=\{repeats\})"
)


def with_pointing(commands: Iterable[WordedCommand]) -> tuple[WordedCommand, ...]:
    """Return the commands, with those that are for referring expressions before the others."""
    found: list[WordedCommand] = []
    for command in commands:
        text = _pointing(command.text)
        if text != command.text:
            found.append(replace(command, text=text, pointed=frozenset({"repeats"})))
        found.append(command)
    return tuple(found)


def _pointing(text: str) -> str:
    if "{repeats}" not in text:
        return text
    rest = _REPEATEDLY.sub("", text)
    if text[0].isupper():
        rest = rest[0].upper() + rest[1:]
    return _RELATIVE_CLAUSE.sub(r"\g<clause>, doing so ", rest)
