"""What control arms show: each figure compares two rates over the same scenes.

A control arm plays a scene again with other words, another goal or another policy seed; the arm
``told`` has the scene's own words. Of a trial, which is a scene with a policy seed, a figure counts
some arms in its first rate and some in its second.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import msgspec

from roboirg.analysis.measures.measure import Measured, pair, with_holm
from roboirg.analysis.results.frame import Frame
from roboirg.analysis.results.option_labels import options_sort_key
from roboirg.analysis.results.policy_run import PolicyRun
from roboirg.core.arms import (
    AGAIN,
    MOST_PARAPHRASES,
    OTHER_GOAL,
    SCRAMBLED,
    SILENT,
    SILENT_EMPTY,
    TOLD,
    paraphrase_number,
)
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.record import Summary
from roboirg.stats.cells import (
    Cell,
    Key,
    Trial,
    rate_interval,
    rows_of,
)
from roboirg.stats.paired_tests import measure_gap
from roboirg.tasks import get_task
from roboirg.tasks.other_goals import begins_with
from roboirg.tasks.splits.splits import get_episode

LANGUAGE_USE = "language use"
WORDS_WORTH = "words' worth"
ORDERS_WORTH = "order's worth"

Arms = Mapping[str, Summary]
"""The results of one trial by arm."""


Trials = dict[Key, dict[str, Summary]]
"""The results of trials by arm."""


class Sides(NamedTuple):
    """What a trial counts in the two rates, as results whose outcome is that."""

    first: Sequence[Summary]
    second: Sequence[Summary]


class ArmContrast(NamedTuple):
    """One figure.

    Attributes:
        name: of the figure.
        first: what the first rate counts, in a word or two.
        second: what the second rate counts.
        sides: returns what a trial counts in each; None if it lacks an arm.
    """

    name: str
    first: str
    second: str
    sides: Callable[[Arms], Sides | None]


class ArmKey(NamedTuple):
    """Policy run as of the arm ``told``, options of the instruction, and which figure."""

    run: PolicyRun
    options: InstructionOptions
    contrast: ArmContrast


ArmFigure = Measured[ArmKey]
"""The results of the first rate, its gap to the second, and its p-value, corrected over all figures
of the policy run."""


def arm_figures(frame: Frame) -> tuple[ArmFigure, ...]:
    """Measure how much a policy heeds its words: each figure is a gap between two control arms.

    A control arm plays a scene again, for example without words. A policy run has the figures of
    `CONTRASTS` for which it played the arms, in each setting. They are measured by setting first,
    and sorted by policy run afterwards.
    """
    groups = _trials_by_group(frame)
    figures = []
    for group in sorted(groups, key=lambda group: options_sort_key(group.options)):
        for contrast in CONTRASTS:
            key = ArmKey(group.run, group.options, contrast)
            figure = _figure(key, groups[group].values())
            if figure is not None:
                figures.append(figure)
    runs = list(dict.fromkeys(group.run for group in groups))
    figures.sort(key=lambda figure: runs.index(figure.key.run))
    return with_holm(figures, lambda key: key.run)


class _Group(NamedTuple):
    """Policy run as of the arm ``told``, and options of the instruction."""

    run: PolicyRun
    options: InstructionOptions


def _trials_by_group(frame: Frame) -> dict[_Group, Trials]:
    """Return the results with a verdict by policy run and options, then by trial and control arm.

    In the frame, the arms of a policy run are policy runs of their own; here they come together
    under the one that has the scenes' own words (the arm ``told``).
    """
    groups: dict[_Group, Trials] = {}
    for run, options, result in rows_of(frame, "run", "options", "result"):
        if not isinstance(result, Summary) or result.outcome == "error":
            continue
        run_with_own_words = run._replace(conditions=run.conditions._replace(arm=TOLD))
        trials = groups.setdefault(_Group(run_with_own_words, options), {})
        trial = (result.task, result.episode, result.policy_seed)
        trials.setdefault(trial, {})[result.arm] = result
    return groups


def _figure(key: ArmKey, trials: Iterable[Arms]) -> ArmFigure | None:
    """Measure one figure, the gap between two rates over the same trials.

    None if no trial was played in all control arms that the figure needs.

    Args:
        key: policy run, options and the figure.
        trials: for each trial, its results by control arm.
    """
    first: dict[str, Cell] = {}
    second: dict[str, Cell] = {}
    for arms in trials:
        sides = key.contrast.sides(arms)
        if sides is not None:
            _count(sides.first, first)
            _count(sides.second, second)
    gap = measure_gap(pair(first, second))
    if gap is None:
        return None
    return Measured(key, first, second, rate_interval(first.values()), gap)


def _count(results: Iterable[Summary], cells: dict[str, Cell]) -> None:
    """Add results to the cells of their tasks.

    A cell has one verdict for each episode and policy seed, so each paraphrase of an instruction
    counts as a policy seed of its own.
    """
    for result in results:
        paraphrase = paraphrase_number(result.arm) or 0  # numbered from 1
        # Different for every pair of a policy seed and a paraphrase.
        seed = result.policy_seed * (MOST_PARAPHRASES + 1) + paraphrase
        cell = cells.setdefault(result.task, Cell())
        cell.add(Trial(result.episode, seed), result.outcome)


def _is_success(result: Summary) -> bool:
    return result.outcome == "success"


def _with_outcome(result: Summary, *, is_success: bool) -> Summary:
    """Return a result as if it had succeeded or failed."""
    return msgspec.structs.replace(result, outcome="success" if is_success else "failure")


def _own_words_against(other: str, arms: Arms) -> Sides | None:
    """Count a trial with the scene's own words against the same trial in another control arm.

    None if either was not played.
    """
    if TOLD not in arms or other not in arms:
        return None
    return Sides([arms[TOLD]], [arms[other]])


def _language_use(arms: Arms) -> Sides | None:
    """Count whether a policy follows words to two goals of a scene, or pursues the same one twice.

    The scene was played twice: its own words state its own goal, those of the control arm
    ``other-goal`` another one. The first side is a success if each goal was reached when it was
    stated, the second one if the same goal was pursued both times. None if either was not played.
    """
    own_words = arms.get(TOLD)
    other = arms.get(OTHER_GOAL)
    if own_words is None or other is None or own_words.goals is None or other.goals is None:
        return None
    reached_each_when_named = _is_success(own_words) and _is_success(other)
    is_own_goal_reached_twice = _is_success(own_words) and other.goals.original == "success"
    # With its own words the world ends at the verdict on its own goal, before the other goal can be
    # reached: a first wrong act that agrees with the other goal counts as pursuing it.
    is_other_goal_begun = other.goals.stated in own_words.goals.agrees
    is_other_goal_pursued_twice = _is_success(other) and is_other_goal_begun
    is_same_pursued = is_own_goal_reached_twice or is_other_goal_pursued_twice
    return Sides(
        [_with_outcome(own_words, is_success=reached_each_when_named)],
        [_with_outcome(own_words, is_success=is_same_pursued)],
    )


def _paraphrases(arms: Arms) -> Sides | None:
    """Count whether all paraphrases of an instruction were solved, against each for itself.

    Of three paraphrases, two of which were solved, the first side has three failures, and the
    second side two successes and a failure: both have a result for each paraphrase, so that they
    can be paired. None with fewer than two paraphrases.

    Args:
        arms: the results of one scene by control arm, in any order; other arms are left out.
    """
    each = [result for arm, result in sorted(arms.items()) if paraphrase_number(arm)]
    if len(each) <= 1:
        return None
    is_all_solved = all(map(_is_success, each))
    all_or_none = [_with_outcome(result, is_success=is_all_solved) for result in each]
    return Sides(all_or_none, each)


CONTRASTS = (
    ArmContrast(LANGUAGE_USE, "each reached when stated", "same pursued", _language_use),
    ArmContrast(WORDS_WORTH, TOLD, SILENT, partial(_own_words_against, SILENT)),
    ArmContrast(WORDS_WORTH, TOLD, SILENT_EMPTY, partial(_own_words_against, SILENT_EMPTY)),
    ArmContrast(ORDERS_WORTH, TOLD, SCRAMBLED, partial(_own_words_against, SCRAMBLED)),
    ArmContrast("paraphrases", "all", "mean", _paraphrases),
    ArmContrast("repeat", TOLD, AGAIN, partial(_own_words_against, AGAIN)),
)
MEANING = (
    "Language use: first, the share of scenes in which each of two goals was reached when stated; "
    "second, that in which the same goal was reached in both rollouts, whichever was stated; told "
    "ends at its verdict, so there the other goal counts if the first wrong act agrees with it. "
    "Words' worth: success when told, then in silence. Order's worth: success when told, then with "
    "scrambled words. Paraphrases: success in all of them, then their mean. Repeat: success when "
    "told, then with another policy seed."
)
"""The two rates of each contrast."""


@functools.lru_cache(maxsize=65_536)
def silent_chance(task: str, split: str, number: int) -> float:
    """Return the success, 0 to 1, to expect of executing a random goal of the scene without words.

    It is the share of the scene's possible goals that are right. Goals that begin with all stages
    of the right one succeed, too.
    """
    episode = get_episode(task, split, number)
    scene = episode.scene
    definition = get_task(task)
    goals = 0
    right_goals = 0
    for goal in definition.goals(scene):
        goals += 1
        right_goals += begins_with(definition.stages(scene, goal), episode.stages)
    return right_goals / goals
