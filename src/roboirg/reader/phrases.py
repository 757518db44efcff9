"""Regular expressions for phrases, and a sentence in which placeholders stand for read phrases.

A *phrase* is words that mean one thing together, *the red cube*. A rule finds phrases by a regular
expression and replaces each by a *placeholder*, ``thing#3``: one word with the kind of the phrase
and the number under which its meaning is stored. The next rules see the placeholder as a word, so
that their patterns can build on it: ``thing#3 next to thing#4``.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple

from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL

Value = Any
"""The meaning of a phrase: a `Description`, a `Place`, a number, ... It depends on its kind."""
PhraseKind = Literal[
    "thing", "place", "each", "way", "target", "passed", "visit", "more", "times", "button", "goal",
    "down", "again", "it", "extra", "first",
]  # fmt: skip
"""Kinds of phrases, each with an example and its meaning. Clauses have arguments of these kinds.

| kind | example | meaning |
| --- | --- | --- |
| ``thing`` | *the red cube* | `things.Description` |
| ``place`` | *next to the button* | `places.Place` |
| ``each`` | *two of each color* | 2 |
| ``way`` | *from right to left* | `series.SwingPath` |
| ``target`` | *the second target* | `series.Target` |
| ``passed`` | *let it pass twice* | 2 |
| ``visit`` | *at the second visit* | `series.Visit` |
| ``times`` | *twice* | 2 |
| ``more`` | *twice more* | 2 |
| ``goal`` | *on the target*, *into the bin* | a target or box, or the noun ``"bin"`` |
| ``button``, ``down``, ``again``, ``it``, ``first`` | *the button* | the words themselves |
| ``extra`` | *lift the cube twice more*: in all, or in addition | 2 |
"""

_MARK = re.compile(r"\(\?P<\w+>|\(\?[:=!<]+|\\.")
"""What stands in a pattern and is no word: the beginning of a group, ``\\d``."""
_WORD = re.compile(r"[a-z][a-z']+")

KNOWN_WORDS: set[str] = set()
"""Every word that stands in a pattern."""

_PARTS: Mapping[str, str] = {
    "NUMBER": NUMBER,
    "ORDINAL": ORDINAL,
    "RANK": rf"(?:{ORDINAL}|last|final|next)",
    "COLOR": COLOR,
    "SIDE": r"(?:left|right)",
    "YOU": r"(?:you|yourself|(?:the )?robot|the arm|your base|the (?:robot's )?base)",
    "VIDEO": r"(?:(?:the |that )?video)",
    "PICTURE": r"(?: (?:of|in) the (?:picture|camera's view|camera view|camera))",
}
"""Regular expressions that words in capital letters stand for; other modules add their own."""


def compiled(pattern: str, parts: Mapping[str, str] = _PARTS) -> re.Pattern[str]:
    """Return a regular expression for whole words; words in capitals in it stand for others.

    ``"the COLOR cube"`` becomes ``the (?:red|green|...) cube``, as ``parts["COLOR"]`` says. All
    lower-case words of the pattern are added to `KNOWN_WORDS`, the words that the interpreter can
    read.
    """
    all_parts = {**_PARTS, **parts}
    # The longest name first, or the beginning of one would pass for another.
    capitals = re.compile("|".join(sorted(all_parts, key=len, reverse=True)))
    while capitals.search(pattern):  # parts are made of other parts
        pattern = capitals.sub(lambda found: all_parts[found[0]], pattern)
    KNOWN_WORDS.update(_WORD.findall(_MARK.sub(" ", pattern)))
    # A match begins after a space, and ends before one or with one that it has taken.
    return re.compile(rf"(?<!\S)(?:{pattern})(?:(?!\S)|(?<= ))")


class Rewrites:
    """Rules that replace words by other words, such as ``"pick up and place=>take and put"``.

    Left of ``=>`` is a pattern as in `compiled`, right of it a replacement as in `re.sub`. The
    order counts: each rule sees what the rules before it have left.
    """

    def __init__(self, *rules: str, parts: Mapping[str, str] = _PARTS) -> None:
        self._rules: list[tuple[re.Pattern[str], str]] = []
        for rule in rules:
            pattern, _, words = rule.partition("=>")
            self._rules.append((compiled(pattern, parts), words))

    def apply(self, text: str) -> str:
        """Return a text after all rules, with single spaces between its words."""
        for pattern, words in self._rules:
            text = " ".join(pattern.sub(words, text).split())
        return text


class Token(NamedTuple):
    """A word of a `PlaceholderText`, or a phrase that a placeholder stands for.

    *Lift the red cube* has two tokens: ``Token("lift")`` and ``Token("the red cube", "thing",
    Description(...))``.

    Attributes:
        text: the word, or the words of the phrase.
        kind: of the phrase; None for a word that is part of no phrase.
        value: the meaning of the phrase; None for such a word.
    """

    text: str
    kind: PhraseKind | None = None
    value: Value = None


class PhraseMatch:
    """A phrase that a rule has found in a sentence, with the groups of the rule's pattern.

    Attributes:
        text: all words of the phrase.
    """

    def __init__(self, match: re.Match[str], sentence: PlaceholderText) -> None:
        self.text = match[0]
        self._groups = match.groupdict()
        self._sentence = sentence

    def __getitem__(self, name: str) -> str:
        """Return the words of a group; empty if it has none, or if the rule has no such group."""
        return self._groups.get(name) or ""

    def value(self, name: str) -> Value:
        """Return the meaning behind the placeholder in a group: of ``thing#3``, or of ``3``."""
        return self._sentence.value(self[name])


class PhraseRule(NamedTuple):
    """How phrases of one pattern are read.

    Attributes:
        kind: of the phrases, which is the first part of their placeholders.
        pattern: of their words.
        read: returns the meaning of a phrase, or None to leave its words as they are.
    """

    kind: PhraseKind
    pattern: re.Pattern[str]
    read: Callable[[PhraseMatch], Value]


class PlaceholderText:
    """A sentence in which placeholders such as ``thing#3`` replace the phrases that were read.

    After the rules for things, *lift the red cube twice* is ``lift thing#0 twice``. The numbers
    count all phrases of the sentence, in the order in which they were read.

    Attributes:
        text: the sentence as it is now, with spaces between the words.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        # What each placeholder stands for, by its number.
        self._phrases: list[Token] = []

    def apply(self, rules: Iterable[PhraseRule]) -> bool:
        """Replace the phrases that rules find by placeholders; return whether any were found.

        The rules apply one after the other, so an earlier one takes its words from later ones.
        """
        before = self.text
        for rule in rules:
            self.text = rule.pattern.sub(functools.partial(self._replace, rule), self.text)
        return self.text != before

    def _replace(self, rule: PhraseRule, match: re.Match[str]) -> str:
        """Store the meaning of a phrase, and return the placeholder that replaces it.

        For *the red cube* it is ``thing#3`` if three phrases were read before. If the rule does not
        read the phrase after all, its words are returned.
        """
        words = match[0]
        value = rule.read(PhraseMatch(match, self))
        if value is None:
            return words
        placeholder = f"{rule.kind}#{len(self._phrases)}"
        self._phrases.append(Token(words, rule.kind, value))
        if words.endswith(" "):  # the space before the next word
            placeholder += " "
        return placeholder

    def value(self, placeholder: str) -> Value:
        """Return the meaning behind a placeholder, ``thing#3``, or behind its number, ``3``."""
        return self._phrase(placeholder).value

    def _phrase(self, placeholder: str) -> Token:
        """Return the phrase that a placeholder, or its number, stands for."""
        return self._phrases[int(placeholder.rpartition("#")[2])]

    def tokens(self) -> Iterator[Token]:
        """Yield the words and the phrases of the sentence, in order.

        A phrase within another phrase is part of that one and not yielded by itself.
        """
        for word in self.text.split():
            yield self._phrase(word) if "#" in word else Token(word)
