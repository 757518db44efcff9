"""Preferences: a remark that names two moments and says which one a person likes better."""

from __future__ import annotations

from collections.abc import Iterable

from roboirg.reader.discourse_context import DiscourseContext
from roboirg.reader.phrases import Phrases
from roboirg.reader.temporal_relations import PressRelation, named_moments
from roboirg.reader.tokens import Sentence

_PREFERRED = Phrases({
    "She prefers the moment before the press to the one after it.":
        r"\b(?:prefers?|likes?|loves?|finds?|chose|chooses|picked|keeps?)\b",
})  # fmt: skip
_LEFT = Phrases({
    "She gave up the moment before the press for the one after it.":
        r"\b(?:trades?|swap(?:s|ped)?|g[ai]ve?s? up|skips?|miss|dropped|leaves)\b.*\bfor\b",
})  # fmt: skip
_REVERSED = Phrases({
    "She likes the moment before the press less than the one after it.":
        r"\b(?:not|never|less|worse)\b",
})  # fmt: skip
"""Each of these words makes the other moment the preferred one."""


def preferred_moment(words: Sentence) -> PressRelation | None:
    """Return the moment that a sentence with two of them prefers; None if it prefers none."""
    text = " ".join(words)
    moments = named_moments(text)
    if len(set(moments)) != 2 or len(moments) != 2:  # noqa: PLR2004 - the two moments
        return None
    left = _LEFT.search(text) is not None
    if not left and _PREFERRED.search(text) is None:
        return None
    return moments[(left + sum(1 for _ in _REVERSED.finditer(text))) % 2]


def with_preference(context: DiscourseContext, sentences: Iterable[Sentence]) -> DiscourseContext:
    """Return a context with the moment that the last such sentence prefers."""
    found = [moment for one in sentences if (moment := preferred_moment(one)) is not None]
    return context._replace(preferred_moment=found[-1]) if found else context
