"""What a learned planner has named, and the looks that it keeps.

A look is a moment at which the front picture is looked at; looks of an episode are numbered from 0,
those of the video first. A planner names subgoals, hands follow them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.episodes import merge_keyframes
from roboirg.extension.sight import LOOK_EVERY
from roboirg_learn.policy.policy_plan import KEYFRAME_PLANNER
from roboirg_learn.policy.subgoals import POINT_NUMBERS

VIDEO_FRAMES = 10
"""Most looks of the video that are kept."""
MAX_SWITCHES = 4
"""Most looks at changes of subgoal that are kept."""
MAX_CHOSEN = 16
"""Most chosen looks that are kept."""
RECENT = 8
"""Latest looks, which are kept, and among which a planner chooses those to keep for good."""
NO_LOOK = -1
"""In the place of a look's number where there is none."""
MAX_LOOKS_SINCE = 40
"""Most looks since a subgoal was named that are counted; more count as this many."""


class SubgoalInputs(NamedTuple):
    """What hands that follow subgoals, or a planner that names them, are given at D decisions.

    Attributes:
        context: (D, C) for hands the subgoal as `encode_request` returns it; for a planner what it
            named before, as `PlannerHistory.context` returns it. `POINT_NUMBERS` are at the end,
            if there is any.
        kept_looks: (D, S) numbers of looks that a planner keeps; `NO_LOOK` fills them up.
        to_keep: (D, RECENT) label of each recent look: 1 to keep it, 0 not to, -1 for nothing to
            learn.
    """

    context: NDArray[np.float32]
    kept_looks: NDArray[np.int64]
    to_keep: NDArray[np.int64]


def requests_for_hands(rows: Sequence[NDArray[np.float32]]) -> SubgoalInputs:
    """Return the network input of hands for D decisions.

    Args:
        rows: the subgoal to follow at each, as `subgoals.encode_request` returns it:
            (REQUEST_SIZE,).
    """
    no_looks = np.full((len(rows), 1), NO_LOOK, np.int64)
    no_labels = np.full((len(rows), RECENT), NO_LOOK, np.int64)
    return SubgoalInputs(np.stack(rows), no_looks, no_labels)


class PlannerHistory:
    """What a planner has named in one episode; keeps the looks at which the subgoal changed.

    Args:
        templates: number of subgoal templates, the texts of subgoals without their points.

    Attributes:
        switches: numbers of the looks at which a new subgoal was named.
        size: how many numbers `kept` returns.
    """

    size = VIDEO_FRAMES + MAX_SWITCHES + 1

    def __init__(self, templates: int) -> None:
        self._templates = templates
        self._named: list[int] = []
        self.switches: list[int] = []

    def name(self, template: int, look: int) -> None:
        """Remember the template of the subgoal named at a look; a repetition changes nothing."""
        if not self._named or self._named[-1] != template:
            self._named.append(template)
            self.switches.append(look)

    def choose(self, looks: Iterable[int]) -> None:
        """Keep looks that the planner chose; this one chooses none."""

    def context(self, look: int) -> NDArray[np.float32]:
        """Return what was named so far, as input of a planner: (2 T + 1 + POINT_NUMBERS,).

        With T templates of subgoals, in this order: T numbers, how often each was finished; T
        numbers, 1 for the template under way and 0 for all others; one number, for how long it has
        been under way, from 0 to 1 at `MAX_LOOKS_SINCE` looks; and `POINT_NUMBERS` zeros, where the
        context of hands has the point of their subgoal. Trained nets depend on this order.

        Args:
            look: number of the present look.
        """
        times_finished = np.zeros(self._templates)
        under_way = np.zeros(self._templates)
        since = 0.0
        if self._named:
            *finished, present = self._named
            np.add.at(times_finished, np.array(finished, int), 1.0)
            under_way[present] = 1.0
            since = min(look - self.switches[-1], MAX_LOOKS_SINCE) / MAX_LOOKS_SINCE
        point = np.zeros(POINT_NUMBERS)
        return np.concatenate([times_finished, under_way, [since], point], dtype=np.float32)

    def kept(self, video: int, look: int) -> NDArray[np.int64]:
        """Return the numbers of the looks that a planner attends to, then `NO_LOOK` up to `size`.

        They are some of the video, evenly spaced, then those that are kept since, the present one
        last.

        Args:
            video: number of looks of the video, which come first.
            look: number of the present look.
        """
        count = min(video, VIDEO_FRAMES)
        looks = np.linspace(0, video - 1, count).round().astype(int).tolist()
        looks += self._kept_since(look)
        kept = np.full(self.size, NO_LOOK, np.int64)
        kept[: len(looks)] = looks
        return kept

    def _kept_since(self, look: int) -> list[int]:
        """Return the numbers of the last looks at changes of subgoal, then the present look's."""
        return [*self.switches[-MAX_SWITCHES:], look]


class KeyframeHistory(PlannerHistory):
    """The looks that a planner chose, and the latest; it does not learn what it named before."""

    size = VIDEO_FRAMES + MAX_CHOSEN + RECENT

    def __init__(self, templates: int) -> None:
        super().__init__(templates)
        self._chosen_looks: tuple[int, ...] = ()

    def choose(self, looks: Iterable[int]) -> None:
        """Keep some looks; neighbors become one look in their middle: 5, 6, 7 → 6.

        The rule is the benchmark's own for keyframes, which counts in control steps.
        """
        steps = [look * LOOK_EVERY for look in (*self._chosen_looks, *looks)]
        self._chosen_looks = tuple(step // LOOK_EVERY for step in merge_keyframes(steps))

    def context(self, look: int) -> NDArray[np.float32]:  # noqa: ARG002
        """Return no numbers: all that the planner knows of the past is in the looks."""
        return np.zeros(0, np.float32)

    def _kept_since(self, look: int) -> list[int]:
        """Return the numbers of the last chosen looks, then of the recent ones."""
        return [*self._chosen_looks[-MAX_CHOSEN:], *recent_looks(look)]


PLANNER_HISTORIES: Mapping[str, type[PlannerHistory]] = {
    "subgoal": PlannerHistory,
    KEYFRAME_PLANNER: KeyframeHistory,
}
"""The history of each of `PLANNERS`, to be made with the number of its subgoal templates."""


def recent_looks(look: int) -> list[int]:
    """Return the numbers of the `RECENT` latest looks, the present one last.

    A number below 0 stands for no look: 2 → -5, -4, …, 1, 2.
    """
    return list(range(look - RECENT + 1, look + 1))


def ideal_planner_inputs(
    history: PlannerHistory, templates: NDArray[np.int64], looks: NDArray[np.int64], video: int
) -> SubgoalInputs:
    """Return the inputs and labels of a planner that has made no mistake so far, for training.

    It names the subgoal that is due at each decision, and keeps the looks where that changes.

    Args:
        history: of the planner; empty at first, and filled here.
        templates: (D,) number of the template due at each decision; -1 where nothing is named.
        looks: (D,) numbers of the looks of the decisions.
        video: number of looks of the video.
    """
    context = []
    kept_looks = []
    to_keep = []
    for template, look in zip(templates.tolist(), looks.tolist(), strict=True):
        # The input is what the planner knows before it names the subgoal of this look.
        context.append(history.context(look))
        kept_looks.append(history.kept(video, look))
        if template >= 0:
            history.name(template, look)
            if history.switches[-1] == look:  # the subgoal has changed
                history.choose([look])
        to_keep.append(_keep_labels(look, history.switches, is_named=template >= 0))
    return SubgoalInputs(np.stack(context), np.stack(kept_looks), np.stack(to_keep))


def _keep_labels(look: int, switches: Sequence[int], *, is_named: bool) -> NDArray[np.int64]:
    """Return for each of the `RECENT` looks up to `look` whether a planner should keep it.

    1 for a look at which the subgoal changed (`switches`), else 0; -1, which is not learned from,
    before the first look, and everywhere if no subgoal is named at `look`.
    """
    recent = np.array(recent_looks(look))
    has_label = (recent >= 0) & is_named
    return np.where(has_label, np.isin(recent, switches), NO_LOOK)
