"""Phrases: regular expressions for the ways to say one thing, each with an example."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

Span = tuple[int, int, str | None]
"""First character, one past the last, and what the words between stand for; None if unclear."""


class Phrases:
    """Ways to say one thing, which are searched in the words of a sentence, joined by spaces.

    Args:
        ways: a pattern for each way, by an example: words in which it matches, and none before it.
        before: a pattern that precedes each of them.
        after: a pattern that follows each of them.

    Attributes:
        by_example: the whole pattern of each way, by its example.
        search: as of a pattern, and so are `match` and `finditer`.
    """

    def __init__(self, ways: Mapping[str, str], *, before: str = "", after: str = "") -> None:
        self.by_example = {
            example: re.compile(f"{before}(?:{way}){after}") for example, way in ways.items()
        }
        pattern = re.compile(f"{before}(?:{'|'.join(ways.values())}){after}")
        self.search = pattern.search
        self.match = pattern.match
        self.finditer = pattern.finditer


class Rewrites:
    """Rules that put other words for some words of a text, one after another.

    Args:
        rules: for each the words of which a text must have one, ``::``, a pattern of words joined
            by spaces, ``=>``, and what replaces it.
        parts: patterns for names in capital letters that the rules use.
    """

    def __init__(self, *rules: str, parts: Mapping[str, str]) -> None:
        named = re.compile("|".join(parts))
        self._rules: list[tuple[frozenset[str], re.Pattern[str], str]] = []
        for rule in rules:
            words, _, rest = rule.partition(":: ")
            pattern, _, replacement = rest.partition("=>")
            full = named.sub(lambda name: parts[name[0]], pattern.removesuffix(" "))
            self._rules.append((frozenset(words.split()), re.compile(full), replacement))
        self._triggers = frozenset().union(*(words for words, _, _ in self._rules))

    def leaves(self, present: Collection[str]) -> bool:
        """Return whether a text with these words stays as it is."""
        return self._triggers.isdisjoint(present)

    def apply(self, text: str, present: Collection[str]) -> str:
        """Return a text with all replacements; `present` are its words."""
        for triggers, pattern, replacement in self._rules:
            if not triggers.isdisjoint(present):
                changed = " ".join(pattern.sub(f"{replacement} ", text).split())
                if changed != text:
                    text, present = changed, frozenset(changed.split())
        return text
