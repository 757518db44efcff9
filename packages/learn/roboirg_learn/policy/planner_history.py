"""What a learned planner has named, and the looks that it keeps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.episodes import merge_keyframes
from roboirg.extension.sight import LOOK_EVERY
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


class PlannedNumbers(NamedTuple):
    """What hands that follow subgoals, or a planner that names them, are given at D decisions.

    Attributes:
        context: (D, C) for hands the subgoal as `encode_request` returns it; for a planner what it
            named before, as `PlannerHistory.context` returns it. `POINT_NUMBERS` are at the end.
        kept_looks: (D, S) numbers of looks that a planner keeps; -1 for none.
        to_keep: (D, RECENT) whether each of the recent looks is to be kept; -1 where there is none.
    """

    context: NDArray[np.float32]
    kept_looks: NDArray[np.int64]
    to_keep: NDArray[np.int64]


def requests_for_hands(rows: Sequence[NDArray[np.float32]]) -> PlannedNumbers:
    """Return the network input of hands for D decisions.

    Args:
        rows: the subgoal to follow at each, as `subgoals.encode_request` returns it.
    """
    no_looks = np.full((len(rows), 1), NO_LOOK, np.int64)
    no_labels = np.full((len(rows), RECENT), NO_LOOK, np.int64)
    return PlannedNumbers(np.stack(rows), no_looks, no_labels)


class PlannerHistory:
    """One episode as a planner remembers it.

    Args:
        forms: number of forms of subgoals.
        chooses: whether it keeps looks that it chose; else it keeps those at changes of subgoal.

    Attributes:
        switches: looks at which a new subgoal was named.
    """

    def __init__(self, forms: int, *, chooses: bool) -> None:
        self._forms = forms
        self._chooses = chooses
        self._forms_named: list[int] = []
        self.switches: list[int] = []
        self._chosen_looks: tuple[int, ...] = ()

    def name(self, form: int, look: int) -> None:
        """Remember the form of the subgoal named at a look; a repetition changes nothing."""
        if not self._forms_named or self._forms_named[-1] != form:
            self._forms_named.append(form)
            self.switches.append(look)

    def choose(self, looks: Iterable[int]) -> None:
        """Keep some looks; neighbors become one look in their middle: 5, 6, 7 → 6.

        The rule is the benchmark's own for keyframes, which counts in control steps.
        """
        steps = [look * LOOK_EVERY for look in (*self._chosen_looks, *looks)]
        self._chosen_looks = tuple(step // LOOK_EVERY for step in merge_keyframes(steps))

    def context(self, look: int) -> NDArray[np.float32]:
        """Return what was named so far, as input of a planner: (`context_size`,).

        How often each form of subgoal was finished; 1 for the form under way; for how long, from 0
        to 1 at `MAX_LOOKS_SINCE`; and zeros in the place of a point.

        Args:
            look: number of the present look.
        """
        done = np.zeros(self._forms)
        under_way = np.zeros(self._forms)
        since = 0.0
        if self._forms_named:
            *finished, present = self._forms_named
            np.add.at(done, np.array(finished, int), 1.0)
            under_way[present] = 1.0
            since = min(look - self.switches[-1], MAX_LOOKS_SINCE) / MAX_LOOKS_SINCE
        point = np.zeros(POINT_NUMBERS)
        return np.concatenate([done, under_way, [since], point], dtype=np.float32)

    def kept(self, video: int, look: int) -> NDArray[np.int64]:
        """Return the numbers of the looks that a planner attends to, then -1 up to a fixed size.

        They are some of the video, evenly spaced, and the present one; between them those that the
        planner chose with the latest ones, or those at changes of subgoal.

        Args:
            video: number of looks of the video, which come first.
            look: number of the present look.
        """
        count = min(video, VIDEO_FRAMES)
        looks = np.linspace(0, video - 1, count).round().astype(int).tolist()
        if self._chooses:
            looks += self._chosen_looks[-MAX_CHOSEN:]
            looks += recent_looks(look)
            size = VIDEO_FRAMES + MAX_CHOSEN + RECENT
        else:
            looks += self.switches[-MAX_SWITCHES:]
            looks.append(look)
            size = VIDEO_FRAMES + MAX_SWITCHES + 1
        kept = np.full(size, NO_LOOK, np.int64)
        kept[: len(looks)] = looks
        return kept


def recent_looks(look: int) -> list[int]:
    """Return the numbers of the recent looks, the present one last; below 0 there is none."""
    return list(range(look - RECENT + 1, look + 1))


def context_size(forms: int) -> int:
    """Return how many numbers `PlannerHistory.context` has."""
    return 2 * forms + 1 + POINT_NUMBERS


def ideal_planner_inputs(
    forms: NDArray[np.int64], looks: NDArray[np.int64], video: int, size: int, *, chooses: bool
) -> PlannedNumbers:
    """Return the inputs and labels of a planner that has made no mistake so far, for training.

    It names the subgoal that is due at each decision, and keeps the looks where that changes.

    Args:
        forms: (D,) number of the form due at each decision; -1 where nothing is named.
        looks: (D,) numbers of the looks of the decisions.
        video: number of looks of the video.
        size: number of forms.
        chooses: whether the planner chooses what it keeps; see `PlannerHistory`.
    """
    history = PlannerHistory(size, chooses=chooses)
    context = []
    kept_looks = []
    to_keep = []
    for form, look in zip(forms.tolist(), looks.tolist(), strict=True):
        context.append(history.context(look))
        kept_looks.append(history.kept(video, look))
        if form >= 0:
            history.name(form, look)
            if history.switches[-1] == look:  # the subgoal has changed
                history.choose([look])
        to_keep.append(_keep_labels(look, history.switches, is_named=form >= 0))
    return PlannedNumbers(np.stack(context), np.stack(kept_looks), np.stack(to_keep))


def _keep_labels(look: int, switches: Sequence[int], *, is_named: bool) -> NDArray[np.int64]:
    """Return for each of the `RECENT` looks up to `look` whether a planner should keep it.

    1 for a look at which the subgoal changed (`switches`), else 0; -1, which is not learned from,
    before the first look, and everywhere if no subgoal is named.
    """
    recent = np.array(recent_looks(look))
    has_label = (recent >= 0) & is_named
    return np.where(has_label, np.isin(recent, switches), NO_LOOK)
