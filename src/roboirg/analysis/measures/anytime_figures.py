"""What two sides show at any time: p-values and intervals that hold however often one looked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.measures.measure import Measured
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.core.plain_text import counted
from roboirg.runs.plan.stopping import PlanScene, scene_order
from roboirg.stats.anytime import PairedScenes, mean_bounds, p_in_any_order, p_path, scene_weights
from roboirg.stats.cells import ByTask, Cell
from roboirg.stats.intervals import Interval
from roboirg.stats.paired_tests import holm, paired_episodes
from roboirg.stats.rates import bounds_text, p_text


class AnytimeFigures(NamedTuple):
    """Evidence on a difference that holds however often one looked.

    Attributes:
        p_holm: p-value, corrected over all that are tested together.
        interval: 95 %, of the mean difference over all planned scenes; None if those that were
            played are no random part of these, as in a run that plays task by task.
        scenes: how many have results of both sides.
        planned: how many both sides are planned to have.
    """

    p_holm: float
    interval: Interval | None
    scenes: int
    planned: int

    @property
    def text(self) -> str:
        """The p-value, and of an unfinished plan where its difference will lie, if known.

        For example ``p = 0.21 after 84 of 550 scenes (over all of them between −2.0 and +30.1
        points, 95 %)``.
        """
        words = p_text(self.p_holm)
        if self.scenes == self.planned:
            return words
        words += f" after {self.scenes} of {counted(self.planned, 'scene')}"
        if self.interval is None:
            return words
        return f"{words} (over all of them {bounds_text(self.interval)}, 95 %)"


def anytime_figures(
    groups: Sequence[Measured[Any]], first: PolicyRun, second: PolicyRun
) -> list[AnytimeFigures]:
    """Return what each group shows against its reference at any time, corrected over all groups.

    Args:
        groups: that are tested together.
        first: that the groups are of.
        second: that their references are of; the same one if these are another setting of it.
    """
    split = first.conditions.split
    every = [paired_scenes(group.cells, group.others, split) for group in groups]
    p_values = []
    intervals: list[Interval | None] = []
    for group, pairs in zip(groups, every, strict=True):
        if _was_looked_at_in_order(group, first, second):
            p_values.append(float(p_path(pairs.differences).min(initial=1.0)))
            intervals.append(mean_bounds(pairs))
        else:
            p_values.append(p_in_any_order(pairs.differences))
            intervals.append(None)
    figures = []
    for pairs, interval, p_holm in zip(every, intervals, holm(p_values), strict=True):
        figures.append(AnytimeFigures(p_holm, interval, len(pairs.differences), pairs.planned))
    return figures


def _was_looked_at_in_order(group: Measured[Any], first: PolicyRun, second: PolicyRun) -> bool:
    """Return whether looks followed the random order of scenes: in a run that stops when decided.

    A stored side that such a run is compared with must have all of its scenes.
    """
    if not (first.is_until_decided or second.is_until_decided):
        return False
    return _is_in_order(group.cells, first) and _is_in_order(group.others, second)


def _is_in_order(cells: ByTask, policy_run: PolicyRun) -> bool:
    """Return whether results are those of the first scenes of the random order, or of all."""
    return policy_run.is_until_decided or not any(cell.missing for cell in cells.values())


def paired_scenes(cells: ByTask, others: ByTask, split: str) -> PairedScenes:
    """Return the differences of two sides in the scenes that both have, in the random order.

    Scenes that a side lacks come last in the order: they were not looked at.

    Args:
        cells: trials of the first side, by task.
        others: those of the second.
        split: of the scenes.
    """
    differences: dict[PlanScene, float] = {}
    planned = {}
    for task in cells.keys() & others.keys():
        found = _differences(cells[task], others[task])
        if found:
            planned[task] = min(_planned_episodes(cells[task]), _planned_episodes(others[task]))
        for episode, difference in found.items():
            differences[PlanScene(task, episode)] = difference
    order = scene_order(differences, split)
    ordered = np.array([differences[scene] for scene in order], dtype=np.float64)
    return PairedScenes(ordered, _weights(order, planned))


def _weights(order: Sequence[PlanScene], planned: Mapping[str, int]) -> NDArray[np.float64]:
    """Return the weights of known scenes in their order, and then of unknown ones.

    Args:
        order: the scenes that are known.
        planned: of each task, how many scenes there are.
    """
    weight_of = scene_weights(planned)
    unknown = dict(planned)
    weights = []
    for scene in order:
        weights.append(weight_of[scene.task])
        unknown[scene.task] -= 1
    for task, count in unknown.items():
        weights += [weight_of[task]] * count
    return np.array(weights)


def _differences(first: Cell, second: Cell) -> dict[int, float]:
    """Return by how much the first is better in each episode that both have, -1 to 1."""
    differences = {}
    for episode, row in paired_episodes(first, second).items():
        differences[episode] = (
            row.first_wins / row.first_trials - row.second_wins / row.second_trials
        )
    return differences


def _planned_episodes(cell: Cell) -> int:
    """Return how many episodes a cell is planned to have, with those that have no verdict."""
    counts = cell.counts
    unknown = counts.errors + counts.missing + counts.spared
    trials_per_episode = max(counts.trials / max(counts.episodes, 1), 1.0)
    return counts.episodes + round(unknown / trials_per_episode)
