"""What the figures of control arms show of made-up policies."""

from __future__ import annotations

import pytest
from flat_jobs import frame_of, make_result

from roboirg.analysis.measures.arm_figures import ArmFigure, arm_figures
from roboirg.analysis.measures.chance import silent_chance
from roboirg.analysis.measures.measure import mean_rate
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.arm_table import language_use_sentences, make_arm_table
from roboirg.analysis.tables.rendering import get_format
from roboirg.core.errors import InvalidValueError
from roboirg.records.record import GoalOutcomes, Summary

TASKS = ("PickXtimes", "VideoUnmask")
SCENES = range(12)


def goals(arm: str, done: str) -> tuple[str, GoalOutcomes]:
    """Return verdict and goals of a policy that does `own` or `other`."""
    stated = "other" if arm == "other-goal" else "own"
    won = done == stated
    return ("success" if won else "failure"), GoalOutcomes(
        stated=stated,
        reached=(done,) if won or arm == "other-goal" else (),
        agrees=() if won else (done,),
        original=("success" if done == "own" else "failure") if arm == "other-goal" else None,
    )


def play(
    policy: str, acts: dict[str, str], scenes: range = SCENES, **fields: object
) -> list[Summary]:
    """Return results of a policy that does something in each arm."""
    found = []
    for arm, done in acts.items():
        outcome, outcomes = goals(arm, done)
        found += [
            make_result(outcome, scene, policy=policy, task=task, arm=arm, goals=outcomes, **fields)
            for task in TASKS
            for scene in scenes
        ]
    return found


LISTENER = {"told": "own", "other-goal": "other", "silent": "none", "scrambled": "none"}
HABIT = {"told": "own", "other-goal": "own", "silent": "own", "scrambled": "own"}
FIXED = {"told": "other", "other-goal": "other", "silent": "other", "scrambled": "other"}


def data_of(*results: list[Summary]) -> RunData:
    return RunData(frame_of(*results))


def rates(arm_figure: ArmFigure) -> tuple[float, float]:
    return float(arm_figure.rate), float(mean_rate(arm_figure.others))


def figure(data: RunData, name: str) -> ArmFigure:
    return next(drawn for drawn in arm_figures(data.frame) if drawn.key.contrast.name == name)


@pytest.mark.parametrize(
    ("acts", "use", "habit", "worth"),
    [(LISTENER, 1.0, 0.0, 1.0), (HABIT, 0.0, 1.0, 0.0), (FIXED, 0.0, 1.0, 0.0)],
)
def test_who_listens_and_who_has_a_habit(acts, use, habit, worth):
    data = data_of(play("mine", acts))
    found = figure(data, "language use")
    assert (rates(found), found.gap.value) == ((use, habit), use - habit)
    assert found.gap.episodes == len(TASKS) * len(SCENES)
    assert found.p_holm < 0.001

    intervals = (found.interval, found.other_interval)
    for interval, rate in zip(intervals, rates(found), strict=True):
        assert interval.low <= rate <= interval.high

    worths = {figure(data, contrast).gap.value for contrast in ("words' worth", "order's worth")}
    assert worths == {worth}


def test_paraphrases_against_their_mean_and_what_counts_in_no_figure():
    half = play("mine", {"told": "own", "paraphrase-1": "own"}, range(8))
    half += play("mine", {"paraphrase-2": "own"}, range(4))
    half += play("mine", {"paraphrase-2": "none"}, range(4, 8))
    found = figure(data_of(half), "paraphrases")

    assert (rates(found), found.gap.value, found.gap.episodes) == ((0.5, 0.75), -0.25, 16)

    # A trial without another arm, and errors.
    results = play("mine", LISTENER, range(3))
    results += [make_result("success", 7, policy="mine", task=TASKS[0])]
    results += [make_result("error", 8, policy="mine", task=TASKS[0], arm=arm) for arm in LISTENER]
    assert figure(data_of(results), "words' worth").gap.episodes == 6


def test_tables_and_sentences_are_as_stored(snapshot):
    """Of a policy that listens, mostly, with another rate in each arm, and one that never does.

    In two settings each, and with two seeds.
    """
    mixed = play("mine", LISTENER | {"scrambled": "own"}, range(6))
    mixed += play("mine", HABIT | {"scrambled": "none"}, range(6, 9))
    mixed += play("mine", FIXED, range(9, 11)) + play("mine", {"again": "own"}, range(4, 11))
    mixed += play("mine", HABIT | {"paraphrase-1": "own"}, range(3), policy_seed=1)
    mixed += play("mine", {"paraphrase-1": "own", "paraphrase-2": "none"}, range(5))
    mixed += play("mine", {"paraphrase-2": "own"}, range(3), policy_seed=1)
    other = [play("mine", HABIT, range(2), setting="direct")]
    other += [play("knows", {"told": "own", "silent-empty": "none"}, setting="direct")]
    table = make_arm_table(data_of(mixed, play("knows", HABIT), *other))

    assert get_format("markdown").draw(table) == snapshot

    told = data_of(play("knows", {"told": "own"}))
    with pytest.raises(InvalidValueError, match="--arms told"):
        make_arm_table(told)

    mine = data_of(mixed)
    knows = data_of(play("knows", HABIT))
    assert [*language_use_sentences(mine.frame, knows.frame, ("mine", "knows"))] == snapshot
    assert not [*language_use_sentences(mine.frame, told.frame, ("", ""))]


def test_chance_in_silence_counts_goals_that_begin_alike():
    # Nine goals: three picks, six pairs. One that is to be lifted is also how two pairs begin.
    for number in range(12):
        assert silent_chance("VideoUnmask", "test", number) in {1 / 9, 3 / 9}
    assert silent_chance("StopCube", "test", 0) == 0.25
