"""Preferences: a remark that names two moments and says which one a person likes better."""

from __future__ import annotations

from collections.abc import Iterable

from roboirg.reader.discourse_context import DiscourseContext
from roboirg.reader.phrases import Phrases
from roboirg.reader.temporal_relations import PressRelation, named_moments
from roboirg.reader.tokens import Sentence

_FIRST = Phrases({
    "She prefers the moment before the press to the one after it.":
        r"\b(?:prefers?|likes?|loves?|chose|chooses|picked|keeps)\b",
})  # fmt: skip
_LAST = Phrases({
    "She gave up the moment before the press for the one after it.":
        r"\b(?:trades?|swapped|gave up|gives up|skips?|dropped|leaves)\b.*\bfor\b",
})  # fmt: skip


def preferred_moment(words: Sentence) -> PressRelation | None:
    """Return the moment that a sentence with two of them prefers; None if it prefers none."""
    text = " ".join(words)
    moments = named_moments(text)
    if len(set(moments)) != 2 or len(moments) != 2:  # noqa: PLR2004 - the two moments
        return None
    if _LAST.search(text):
        return moments[1]
    return moments[0] if _FIRST.search(text) else None


def with_preference(context: DiscourseContext, sentences: Iterable[Sentence]) -> DiscourseContext:
    """Return a context with the moment that the last such sentence prefers."""
    found = [moment for one in sentences if (moment := preferred_moment(one)) is not None]
    return context._replace(preferred_moment=found[-1]) if found else context
