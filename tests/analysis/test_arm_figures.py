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


def results_of_policy(
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


DOES_WHAT_IT_HEARS = {"told": "own", "other-goal": "other", "silent": "none", "scrambled": "none"}
SAME_GOAL_IN_EVERY_ARM = {"told": "own", "other-goal": "own", "silent": "own", "scrambled": "own"}
ALWAYS_THE_OTHER_GOAL = {
    "told": "other",
    "other-goal": "other",
    "silent": "other",
    "scrambled": "other",
}


def run_data_of(*results: list[Summary]) -> RunData:
    return RunData(frame_of(*results))


def both_rates(arm_figure: ArmFigure) -> tuple[float, float]:
    return float(arm_figure.rate), float(mean_rate(arm_figure.others))


def figure_named(data: RunData, name: str) -> ArmFigure:
    return next(drawn for drawn in arm_figures(data.frame) if drawn.key.contrast.name == name)


@pytest.mark.parametrize(
    ("acts", "use", "habit", "worth"),
    [
        (DOES_WHAT_IT_HEARS, 1.0, 0.0, 1.0),
        (SAME_GOAL_IN_EVERY_ARM, 0.0, 1.0, 0.0),
        (ALWAYS_THE_OTHER_GOAL, 0.0, 1.0, 0.0),
    ],
)
def test_who_follows_the_words_is_told_from_who_does_the_same_whatever_it_hears(
    acts, use, habit, worth
):
    """Each episode is played in four arms: the instruction, another goal, silence, mixed words.

    *Language use* is the rate at which the goal that was stated is done, minus that of the own goal
    where another one was stated. Would find one arm counted as another.
    """
    data = run_data_of(results_of_policy("mine", acts))
    found = figure_named(data, "language use")
    assert (both_rates(found), found.gap.value) == ((use, habit), use - habit)
    assert found.gap.episodes == len(TASKS) * len(SCENES)
    assert found.p_holm < 0.001

    intervals = (found.interval, found.other_interval)
    for interval, rate in zip(intervals, both_rates(found), strict=True):
        assert interval.low <= rate <= interval.high

    worths = {
        figure_named(data, contrast).gap.value for contrast in ("words' worth", "order's worth")
    }
    assert worths == {worth}


def test_paraphrases_are_compared_with_the_instruction_and_incomplete_episodes_are_left_out():
    """Of 8 episodes in 2 tasks the first paraphrase wins all, the second half: 0.75 on average.

    Would find paraphrases that are pooled, or an episode without its counterpart that counts.
    """
    half = results_of_policy("mine", {"told": "own", "paraphrase-1": "own"}, range(8))
    half += results_of_policy("mine", {"paraphrase-2": "own"}, range(4))
    half += results_of_policy("mine", {"paraphrase-2": "none"}, range(4, 8))
    found = figure_named(run_data_of(half), "paraphrases")

    assert (both_rates(found), found.gap.value, found.gap.episodes) == ((0.5, 0.75), -0.25, 16)

    # Of 3 complete episodes in 2 tasks, one that was played in a single arm, and one of errors.
    results = results_of_policy("mine", DOES_WHAT_IT_HEARS, range(3))
    results += [make_result("success", 7, policy="mine", task=TASKS[0])]
    results += [
        make_result("error", 8, policy="mine", task=TASKS[0], arm=arm) for arm in DOES_WHAT_IT_HEARS
    ]
    assert figure_named(run_data_of(results), "words' worth").gap.episodes == 6


def test_tables_and_sentences_are_as_stored(snapshot):
    """Of a policy that listens, mostly, with another rate in each arm, and one that never does.

    In two settings each, and with two seeds.
    """
    mixed = results_of_policy("mine", DOES_WHAT_IT_HEARS | {"scrambled": "own"}, range(6))
    mixed += results_of_policy("mine", SAME_GOAL_IN_EVERY_ARM | {"scrambled": "none"}, range(6, 9))
    mixed += results_of_policy("mine", ALWAYS_THE_OTHER_GOAL, range(9, 11)) + results_of_policy(
        "mine", {"again": "own"}, range(4, 11)
    )
    mixed += results_of_policy(
        "mine", SAME_GOAL_IN_EVERY_ARM | {"paraphrase-1": "own"}, range(3), policy_seed=1
    )
    mixed += results_of_policy("mine", {"paraphrase-1": "own", "paraphrase-2": "none"}, range(5))
    mixed += results_of_policy("mine", {"paraphrase-2": "own"}, range(3), policy_seed=1)
    other = [results_of_policy("mine", SAME_GOAL_IN_EVERY_ARM, range(2), setting="direct")]
    other += [results_of_policy("knows", {"told": "own", "silent-empty": "none"}, setting="direct")]
    table = make_arm_table(
        run_data_of(mixed, results_of_policy("knows", SAME_GOAL_IN_EVERY_ARM), *other)
    )

    assert get_format("markdown").draw(table) == snapshot

    told = run_data_of(results_of_policy("knows", {"told": "own"}))
    with pytest.raises(InvalidValueError, match="--arms told"):
        make_arm_table(told)

    mine = run_data_of(mixed)
    knows = run_data_of(results_of_policy("knows", SAME_GOAL_IN_EVERY_ARM))
    assert [*language_use_sentences(mine.frame, knows.frame, ("mine", "knows"))] == snapshot
    assert not [*language_use_sentences(mine.frame, told.frame, ("", ""))]


def test_the_chance_to_guess_a_goal_in_silence_counts_goals_that_begin_alike():
    """Lifting one of three things is a goal; lifting two in order is another: 3 + 6 goals.

    Who lifts the first thing of a pair is right about two pairs, too: 1 of 9 goals, or 3 of 9.
    """
    for episode in range(12):
        assert silent_chance("VideoUnmask", "test", episode) in {1 / 9, 3 / 9}
    assert silent_chance("StopCube", "test", 0) == 0.25
