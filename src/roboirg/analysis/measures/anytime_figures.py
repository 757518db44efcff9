"""What two sides show at any time: p-values and intervals that hold however often one looked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.analysis.measures.measure import Measured
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.runs.plan.stopping import PlanScene, scene_order
from roboirg.stats.anytime import PairedScenes, mean_bounds, p_in_any_order, p_path, scene_weights
from roboirg.stats.cells import ByTask, Cell
from roboirg.stats.intervals import Interval
from roboirg.stats.paired_tests import holm, paired_episodes
from roboirg.stats.rates import anytime_text


class AnytimeFigures(NamedTuple):
    """Evidence on a difference that holds however often one looked.

    Attributes:
        p_holm: p-value, corrected over all that are tested together.
        interval: 95 %, of the mean difference over all planned scenes; None if those that were
            played are no random part of these, as in a run that plays task by task.
        pairs: the scenes with results of both sides.
    """

    p_holm: float
    interval: Interval | None
    pairs: PairedScenes

    @property
    def text(self) -> str:
        """The p-value, and of an unfinished plan where its difference will lie, if known."""
        return anytime_text(self.p_holm, self.pairs, self.interval)


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
        figures.append(AnytimeFigures(p_holm, interval, pairs))
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
    first_planned = _planned_episodes(cells)
    second_planned = _planned_episodes(others)
    for task in cells.keys() & others.keys():
        planned[task] = min(first_planned[task], second_planned[task])
        for episode, difference in _differences(cells[task], others[task]).items():
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
    weights = [weight_of[scene.task] for scene in order]
    known = Counter(scene.task for scene in order)
    for task, count in planned.items():
        weights += [weight_of[task]] * (count - known[task])
    return np.array(weights)


def _differences(first: Cell, second: Cell) -> dict[int, float]:
    """Return by how much the first is better in each episode that both have, -1 to 1."""
    differences = {}
    for episode, row in paired_episodes(first, second).items():
        differences[episode] = (
            row.first_wins / row.first_trials - row.second_wins / row.second_trials
        )
    return differences


def _planned_episodes(cells: ByTask) -> dict[str, int]:
    """Return how many episodes each task is planned to have, with those that have no verdict.

    All tasks are played under the same seeds; before any verdict, one is taken to be planned.
    """
    seeds: set[int] = set()
    for cell in cells.values():
        seeds.update(trial.policy_seed for trial in cell.verdicts)
    planned = {}
    for task, cell in cells.items():
        counts = cell.counts
        trials = counts.trials + counts.errors + counts.missing + counts.spared
        planned[task] = max(counts.episodes, round(trials / max(len(seeds), 1)))
    return planned
