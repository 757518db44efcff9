"""When a planner queries its model: before each chunk of actions, every N steps, or after news.

*News* is that something was said, or that a subgoal ended.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from roboirg.core.subgoal_text import split_point
from roboirg.policies.planners.planner import EACH_CHUNK, WHEN_DONE

Asked = Annotated[str, Field(pattern=rf"^({EACH_CHUNK}|{WHEN_DONE}|every [1-9]\d* steps)$")]
"""When a planner is asked, such as ``every 48 steps``."""
MOST_USELESS = 5
"""Unusable replies in a row after which a planner that is asked ``when-done`` asks no more."""


class QuerySchedule:
    """Decides for each chunk of an episode whether a planner queries its model.

    Args:
        asked: when it is queried: ``each-chunk``, ``when-done`` or ``every N steps``.
        first_pause: control steps of the episode before which there is no second query.
        holds: subgoals without points that are kept, and the last control steps at which they are.

    Attributes:
        has_news: whether there was news since the last query.
        useless: replies in a row that were of no use.
    """

    def __init__(self, asked: Asked, first_pause: int, holds: Mapping[str, int]) -> None:
        self._waits_for_news = asked == WHEN_DONE
        number = re.search(r"\d+", asked)  # of "every 16 steps"
        self._period = int(number[0]) if number else 1  # control steps
        self._last_period = -1
        self._first_pause = first_pause
        self._holds = holds
        self.has_news = False
        self.useless = 0

    def is_due(self, subgoal: str | None, step: int) -> bool:
        """Return whether to query the model now; to be called once for each chunk of actions.

        With ``every N steps`` it is due at the first chunk of each period of N steps, with
        ``when-done`` after news. Without any subgoal yet it is always due, but for a planner that
        has given up.

        Args:
            subgoal: the present one; None for none.
            step: control steps of the episode so far; it never decreases.
        """
        period = step // self._period
        begins_period = period > self._last_period
        self._last_period = period
        if self._waits_for_news and self.useless >= MOST_USELESS:
            return False
        if subgoal is None:
            return True
        if self._waits_for_news and not self.has_news:
            return False
        words, _ = split_point(subgoal)
        is_held = step <= self._holds.get(words, -1) or step < self._first_pause
        return begins_period and not is_held

    def note_reply(self, *, is_useful: bool) -> None:
        """Note a reply; one that was of no use has not answered the news, which stay."""
        self.has_news = not is_useful
        self.useless = 0 if is_useful else self.useless + 1
