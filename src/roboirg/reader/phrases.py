"""Phrases: regular expressions for the ways to say one thing, each with an example."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping


class Phrases:
    """Ways to say one thing, which are searched in the words of a sentence, joined by spaces.

    Args:
        ways: a pattern for each way, by an example: words in which it matches, and none before it.
        before: a pattern that precedes each of them.
        after: a pattern that follows each of them.

    Attributes:
        by_example: the whole pattern of each way, by its example.
    """

    def __init__(self, ways: Mapping[str, str], *, before: str = "", after: str = "") -> None:
        self.by_example = {
            example: re.compile(f"{before}(?:{way}){after}") for example, way in ways.items()
        }
        self._any = re.compile(f"{before}(?:{'|'.join(ways.values())}){after}")

    def search(self, text: str) -> re.Match[str] | None:
        return self._any.search(text)

    def match(self, text: str, at: int = 0) -> re.Match[str] | None:
        return self._any.match(text, at)

    def finditer(self, text: str) -> Iterator[re.Match[str]]:
        return self._any.finditer(text)


class Rewrites:
    """Ways to say something in other words, which are replaced one after another.

    Args:
        ways: for each way, by an example, the words of which a sentence must have one, a pattern of
            words joined by spaces, and what replaces it.

    Attributes:
        by_example: the words, pattern and replacement of each way.
    """

    def __init__(self, ways: Mapping[str, tuple[str, str, str]]) -> None:
        self.by_example = {
            example: (frozenset(triggers.split()), re.compile(pattern), replacement)
            for example, (triggers, pattern, replacement) in ways.items()
        }
        self._triggers = frozenset().union(*(one[0] for one in self.by_example.values()))

    def apply(self, words: tuple[str, ...]) -> tuple[str, ...]:
        """Return words with all replacements."""
        if self._triggers.isdisjoint(words):
            return words
        for triggers, pattern, replacement in self.by_example.values():
            if not triggers.isdisjoint(words):
                words = tuple(pattern.sub(replacement, " ".join(words)).split())
        return words
