"""What has to be known about a kind of value to speak of it in every setting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from roboirg.language.phrases import Phrase
from roboirg.language.request import Part, PartKind, Request


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of value.

    Attributes:
        name: as in `PartKind`.
        named: the words of the command that name a value outright.
        reduced: for each field of the command, words that point back at the introduced values.
        introduce: a sentence that names the values.
        pointing: the words that a reinforcement uses for the values.
        reinforcements: sentences with a field ``{ref}`` for those words.
        competitors: sentences with a field ``{other}`` for a value that is not meant.
        values: everything that such a sentence may name.
        word: a value in words.
    """

    name: PartKind
    named: Callable[[Request, Part], Phrase]
    reduced: Callable[[Request, tuple[Part, ...]], dict[str, Phrase]]
    introduce: Callable[[Request, tuple[Part, ...]], Phrase]
    pointing: Callable[[tuple[Part, ...]], Phrase]
    reinforcements: tuple[str, ...]
    competitors: tuple[str, ...]
    values: tuple[str | int, ...]
    word: Callable[[str | int], str]
