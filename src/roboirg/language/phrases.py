"""Words with the mentions in them, whose exact spans are kept."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.language.instruction import Expression, Mention, Role

_FIELD = re.compile(r"\{(?P<name>[a-z_.0-9]+)\}")

_PARTICLE = re.compile(
    r"(?<=\b(?:pick|lift|take|hold) )up $|(?<=\b(?:put|set|lay) )down $", re.IGNORECASE
)
"""*up* or *down* after its verb, at the end of words: *Please pick up*."""
_PRONOUNS = ("it", "them")


class Tag(NamedTuple):
    """What a piece of text stands for; the fields are those of the `Mention` that it becomes.

    Attributes:
        role: antecedent or anaphor.
        expression: class of an anaphor, ``it``; None for an antecedent.
        slot: of the goal, or ``reference``.
        value: the referent.
    """

    role: Role
    expression: Expression | None
    slot: str
    value: str | int


class TaggedText(NamedTuple):
    """A piece of text: a mention of a value if it has a tag, else plain words.

    *it* with the tag ``Tag("anaphor", "it", "color", "red")``.
    """

    text: str
    tag: Tag | None = None


Phrase = tuple[TaggedText, ...]


def plain(text: str) -> Phrase:
    """Return words that mention no value, as a phrase."""
    return (TaggedText(text),)


def antecedent(text: str, slot: str, value: str | int) -> Phrase:
    """Return words that name a value of a slot, *red*, as a phrase."""
    return (TaggedText(text, Tag("antecedent", None, slot, value)),)


def anaphor(text: str, expression: Expression, slot: str, value: str | int) -> Phrase:
    """Return words that point back at a value of a slot, *it*, as a phrase.

    Args:
        text: the words.
        expression: their class, ``it``.
        slot: of the value.
        value: that they stand for.
    """
    return (TaggedText(text, Tag("anaphor", expression, slot, value)),)


def fill(template: str, fields: Mapping[str, Phrase]) -> Phrase:
    """Return a sentence whose fields in braces are replaced by phrases, words with their tags.

    ``"Lift the {color} cube."`` with *red* for ``color`` becomes the pieces *Lift the*, *red* and
    *cube.*; *red* keeps its tag, which says what it stands for.
    """
    pieces = []
    template_position = 0
    for field in _FIELD.finditer(template):
        pieces.append(TaggedText(template[template_position : field.start()]))
        pieces.extend(fields[field["name"]])
        template_position = field.end()
    pieces.append(TaggedText(template[template_position:]))
    return tuple(piece for piece in pieces if piece.text)


def swap_particles(phrase: Phrase) -> Phrase:
    """Move a pronoun between a verb and its particle: ``pick up it`` becomes ``pick it up``.

    Only a pronoun with a tag, a mention of a value, is moved; the phrase keeps all its other words.
    """
    pieces = list(phrase)
    # From the end, so that a change moves no piece that is still to be looked at.
    for position in range(len(pieces) - 1, 0, -1):
        piece_before = pieces[position - 1]
        pronoun = pieces[position]
        if piece_before.tag is not None or pronoun.tag is None or pronoun.text not in _PRONOUNS:
            continue
        particle = _PARTICLE.search(piece_before.text)
        if particle is not None:
            verb = TaggedText(piece_before.text[: particle.start()])
            particle_after = TaggedText(f" {particle[0].strip()}")
            pieces[position - 1 : position + 1] = [verb, pronoun, particle_after]
    return tuple(pieces)


def listed(phrases: Sequence[Phrase], joint: str = "and") -> Phrase:
    """Join phrases into a list: *a*, *a and b*, *a, b and c*.

    `joint` is the word before the last phrase; *nor* stands before each: *a nor b nor c*.
    """
    pieces = []
    last = len(phrases) - 1
    for position, phrase in enumerate(phrases):
        separator = ", "
        if position == last or joint == "nor":
            separator = f" {joint} "
        if position > 0:
            pieces.append(TaggedText(separator))
        pieces.extend(phrase)
    return tuple(pieces)


def words_of(phrase: Phrase) -> str:
    """Return the words of a phrase as a text, without its tags."""
    return "".join(piece.text for piece in phrase)


def mentions_in(phrase: Phrase, utterance: int) -> Iterator[Mention]:
    """Yield a mention for each piece of a phrase that has a tag, in order.

    A mention has its first and last characters in the text of the phrase. Of *Lift it*, in which
    *it* has a tag, it starts at 5 and ends at 7. `utterance` is the number of the utterance.
    """
    start = 0
    for piece in phrase:
        end = start + len(piece.text)
        if piece.tag is not None:
            yield Mention(utterance, start, end, *piece.tag)
        start = end


def capitalized(text: str) -> str:
    """Return a text with a capital letter at the beginning of every sentence.

    It has as many characters as before, since mentions are positions in it.
    """
    return re.sub(r"(?:^|[.!?] )[a-z]", lambda begin: begin[0].upper(), text)
