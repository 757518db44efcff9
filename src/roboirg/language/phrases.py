"""Fill templates with phrases, and keep the exact spans of mentions.

A template is a sentence with fields and alternatives: ``{cube}`` takes a phrase, and
``[was|were]`` takes its first form in the singular and its second in the plural.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, Protocol

from roboirg.language.instruction import (
    REFERENCE,
    Expression,
    Mention,
    Role,
    Utterance,
    UtteranceStage,
)

_MARK = re.compile(r"\{(?P<field>[a-z_.0-9]+)\}|\[(?P<one>[^\[\]|]*)\|(?P<many>[^\[\]|]*)\]")

_PARTICLE = re.compile(
    r"(?<=\b(?:pick|lift|take|hold) )up $|(?<=\b(?:put|set|lay) )down $", re.IGNORECASE
)
_PRONOUNS = ("it", "them")


class Tag(NamedTuple):
    """The referent of a piece of text; see `Mention`."""

    role: Role
    expression: Expression | None
    slot: str
    value: str | int


class TaggedText(NamedTuple):
    """A run of characters: one mention if it has a tag, else none."""

    text: str
    tag: Tag | None = None


Phrase = tuple[TaggedText, ...]


def plain(text: str) -> Phrase:
    """Return words that are no mention."""
    return (TaggedText(text),)


class Mentionable(Protocol):
    """What a mention stands for: a value of a slot."""

    @property
    def slot(self) -> str:
        """The name of the slot."""

    @property
    def value(self) -> str | int:
        """The value."""


class MentionedValue(NamedTuple):
    """A value that only leads to the goal, such as a number to count from, or several of a slot."""

    value: str | int
    slot: str = REFERENCE


def antecedent(text: str, referent: Mentionable) -> Phrase:
    """Return words that introduce a value."""
    return (TaggedText(text, Tag("antecedent", None, referent.slot, referent.value)),)


def anaphor(text: str, expression: Expression, referent: Mentionable) -> Phrase:
    """Return words that point back at a value."""
    return (TaggedText(text, Tag("anaphor", expression, referent.slot, referent.value)),)


def fill(template: str, fields: Mapping[str, Phrase], *, plural: bool = False) -> Phrase:
    """Fill the fields of a template, and choose singular or plural alternatives."""
    pieces: list[TaggedText] = []
    end = 0
    for mark in _MARK.finditer(template):
        pieces.append(TaggedText(template[end : mark.start()]))
        name = mark["field"]
        if name is not None:
            pieces.extend(fields[name])
        else:
            pieces.append(TaggedText(mark["many"] if plural else mark["one"]))
        end = mark.end()
    pieces.append(TaggedText(template[end:]))
    return tuple(piece for piece in pieces if piece.text)


def swap_particles(phrase: Phrase) -> Phrase:
    """Move a pronoun between a verb and its particle: ``pick up it`` becomes ``pick it up``."""
    pieces = list(phrase)
    for at in range(len(pieces) - 1, 0, -1):
        before, pronoun = pieces[at - 1 : at + 1]
        found = _PARTICLE.search(before.text)
        if found and before.tag is None and pronoun.tag and pronoun.text in _PRONOUNS:
            verb = TaggedText(before.text[: found.start()])
            pieces[at - 1 : at + 1] = [verb, pronoun, TaggedText(f" {found[0].strip()}")]
    return tuple(pieces)


def listed(phrases: Sequence[Phrase], joint: str = "and") -> Phrase:
    """Join phrases into a list: ``a``, ``a and b``, ``a, b and c``; *nor* joins all of them."""
    pieces: list[TaggedText] = []
    for position, phrase in enumerate(phrases):
        if position:
            last = position == len(phrases) - 1
            pieces.append(TaggedText(f" {joint} " if last or joint == "nor" else ", "))
        pieces.extend(phrase)
    return tuple(pieces)


def sentences(phrases: Iterable[Phrase]) -> Phrase:
    """Join complete sentences with spaces."""
    pieces: list[TaggedText] = []
    for phrase in phrases:
        if pieces:
            pieces.append(TaggedText(" "))
        pieces.extend(phrase)
    return tuple(pieces)


def words_of(phrase: Phrase) -> str:
    """Return the words of a phrase, without its mentions."""
    return "".join(piece.text for piece in phrase)


def speak(
    index: int, stage: UtteranceStage, phrase: Phrase, *, capitalize: bool = True
) -> tuple[Utterance, tuple[Mention, ...]]:
    """Turn a phrase into the utterance of number `index`, and its tags into mentions."""
    mentions: list[Mention] = []
    start = 0
    for piece in phrase:
        end = start + len(piece.text)
        if piece.tag is not None:
            mentions.append(Mention(index, start, end, *piece.tag))
        start = end
    text = words_of(phrase)
    return Utterance(stage, _capitalized(text) if capitalize else text), tuple(mentions)


def _capitalized(text: str) -> str:
    """Capitalize every sentence, without adding or removing characters."""
    return re.sub(r"(^|[.!?] )([a-z])", lambda found: found[1] + found[2].upper(), text)
