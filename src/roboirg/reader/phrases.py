"""Tables of regular expressions, and a sentence whose phrases are replaced by what they mean.

- *phrase*: words that mean one thing together, *the red cube*.
- *chunk*: the word that takes the place of a phrase that is read, ``thing#3``.
- *rule*: which phrases become chunks of a kind. Rules apply one after the other to what is left.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL

Value = Any
"""What a phrase means: a place, a thing, a number, ..."""

_MARK = re.compile(r"\(\?P<\w+>|\(\?[:=!<]+|\\.")
"""What stands in a pattern and is no word: the beginning of a group, ``\\d``."""
_WORD = re.compile(r"[a-z][a-z']+")

KNOWN_WORDS: set[str] = set()
"""Every word of a table."""

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
"""What stands in a pattern for words in capital letters; tables add their own."""


def compiled(pattern: str, parts: Mapping[str, str] = _PARTS) -> re.Pattern[str]:
    """Return a regular expression for whole words; words in capitals in it stand for others.

    ``"the COLOR cube"`` becomes ``the (?:red|green|...) cube``. `parts` has what such words stand
    for. The small words are added to `KNOWN_WORDS`, those that the interpreter can read.
    """
    all_parts = {**_PARTS, **parts}
    # The longest name first, or the beginning of one would pass for another.
    capitals = re.compile("|".join(sorted(all_parts, key=len, reverse=True)))
    while capitals.search(pattern):  # parts are made of other parts
        pattern = capitals.sub(lambda found: all_parts[found[0]], pattern)
    KNOWN_WORDS.update(_WORD.findall(_MARK.sub(" ", pattern)))
    return re.compile(rf"(?<!\S)(?:{pattern})(?:(?!\S)|(?<= ))")


class Rewrites:
    """Rules that replace words by words, each ``pattern=>words``, in their order."""

    def __init__(self, *rules: str, parts: Mapping[str, str] = _PARTS) -> None:
        self._rules: list[tuple[re.Pattern[str], str]] = []
        for rule in rules:
            pattern, _, words = rule.partition("=>")
            self._rules.append((compiled(pattern, parts), words))

    def apply(self, text: str) -> str:
        """Return a text with all rules applied."""
        for pattern, words in self._rules:
            text = " ".join(pattern.sub(words, text).split())
        return text


class Token(NamedTuple):
    """A chunk, or a word outside of all chunks.

    Attributes:
        kind: of the chunk; or the word.
        value: what the chunk means; None for a word.
        text: the words for which the chunk stands; or the word.
    """

    kind: str
    value: Value
    text: str


class FoundPhrase:
    """A phrase that a rule has found in a sentence.

    Attributes:
        text: all of it.
    """

    def __init__(self, match: re.Match[str], chunks: Chunks) -> None:
        self.text = match[0]
        self._groups = match.groupdict()
        self._chunks = chunks

    def __getitem__(self, name: str) -> str:
        """Return the words of a group; empty if it has none, or if the rule has no such group."""
        return self._groups.get(name) or ""

    def value(self, name: str) -> Value:
        """Return what the chunk means that a group has found, by its word or its number."""
        return self._chunks.value(self[name])


class PhraseRule(NamedTuple):
    """How phrases of one pattern are read.

    Attributes:
        kind: of the chunks that take their place, ``thing``.
        pattern: of their words.
        read: returns what one of them means; None leaves its words as they are.
    """

    kind: str
    pattern: re.Pattern[str]
    read: Callable[[FoundPhrase], Value]


class Chunks:
    """A sentence in which phrases are replaced, step by step, by chunks: words such as ``thing#3``.

    Attributes:
        text: what is left of it, with spaces between the words.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self._values: list[Value] = []
        self._words: list[str] = []

    def apply(self, rules: Iterable[PhraseRule]) -> bool:
        """Replace the phrases that rules find by chunks, and return whether any were found.

        *The red cube* becomes the chunk ``thing#3``, one word with a number for what the phrase
        means. The rules apply one after the other.
        """
        before = self.text
        for rule in rules:
            self.text = rule.pattern.sub(functools.partial(self._chunk, rule), self.text)
        return self.text != before

    def _chunk(self, rule: PhraseRule, match: re.Match[str]) -> str:
        """Return the word for a phrase that was read, ``thing#3``, and store what the phrase means.

        The number is that of the stored meaning. The words themselves are returned if the rule
        cannot read them.
        """
        words = match[0]
        value = rule.read(FoundPhrase(match, self))
        if value is None:
            return words
        number = len(self._values)
        self._values.append(value)
        self._words.append(words)
        space = " " if words.endswith(" ") else ""  # which the match has taken
        return f"{rule.kind}#{number}{space}"

    def value(self, word: str) -> Value:
        """Return the value of a chunk, by its word or its number alone."""
        return self._values[int(word.rpartition("#")[2])]

    def tokens(self) -> Iterator[Token]:
        """Yield the words of the sentence; a phrase that was read is one, with its meaning.

        Of ``lift thing#3``: the word *lift*, with the value None, and *thing* with the description
        of a thing. Words of a chunk within a chunk are left out.
        """
        for word in self.text.split():
            kind, mark, number = word.partition("#")
            if mark:
                yield Token(kind, self.value(word), self._words[int(number)])
            else:
                yield Token(word, None, word)
