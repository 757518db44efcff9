"""Leftovers: values that a command names and its reading does not use."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from roboirg.reader.command import Command
from roboirg.reader.ordinals import named_positions
from roboirg.reader.quantities import times_mentions
from roboirg.reader.tokens import colors_in


def left_over(command: Command, slots: Collection[str]) -> Iterator[str]:
    """Yield a complaint for each kind of value that a command names and that no slot takes."""
    if "repeats" in slots:
        mentions = times_mentions(command.text)
        numbers = {one.expression.quantity for one in mentions if one.plain}
        if len(numbers) > 1:
            named = " and ".join(command.text[one.start : one.end] for one in mentions if one.plain)
            yield f'does not know which number of times is meant, "{named}"'
    if not {"visit", "placement"}.isdisjoint(slots):
        positions = set(named_positions(command.text))
        if len(positions) > 1:
            yield f'does not know which of "{sorted(positions)}" is meant'
    elif "relation" not in slots:
        parts = (*command.handled, *command.added, *command.entered)
        used = {color for words in parts for color in colors_in(words)}
        unused = dict.fromkeys(
            color for color in colors_in(tuple(command.text.split())) if color not in used
        )
        if parts and unused:
            yield f'does not understand what is to be done with "{" and ".join(unused)}"'
