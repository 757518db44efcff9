"""What the figures of control arms show of made-up policies."""

from __future__ import annotations

import pytest
from flat_jobs import frame_of, make_result

from roboirg.analysis.measures.arm_figures import arm_figures
from roboirg.analysis.measures.chance import silent_chance
from roboirg.analysis.measures.measure import mean_rate
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.arm_table import language_use_sentences, make_arm_table
from roboirg.analysis.tables.rendering import get_format
from roboirg.core.errors import InvalidValueError
from roboirg.records.record import GoalOutcomes
from roboirg.stats.cells import rate_interval

TASKS = ("PickXtimes", "VideoUnmask")
SCENES = range(12)


def goals(arm, done):
    """Return the verdict of an episode, and which goals were reached in it.

    In the arm `other-goal` the instruction states the `other` goal of the scene, elsewhere its
    `own`. A policy that does what was stated wins: ``goals("told", "own")`` is a success,
    ``goals("other-goal", "own")`` a failure.

    Args:
        arm: how the instruction was given, such as `told` or `silent`.
        done: the goal that the policy reached: `own`, `other` or `none`.
    """
    stated = "other" if arm == "other-goal" else "own"
    if done == stated:
        outcome = "success"
        outcomes = {"reached": (done,), "agrees": ()}
    else:
        outcome = "failure"
        outcomes = {"reached": (done,) if arm == "other-goal" else (), "agrees": (done,)}
    if arm == "other-goal":
        outcomes["original"] = "success" if done == "own" else "failure"
    return outcome, GoalOutcomes(stated=stated, **outcomes)


def results_of_policy(policy, acts, scenes=SCENES, **fields):
    """Return results of a policy in some scenes of both tasks.

    Args:
        policy: its name.
        acts: the goal that it reaches in each arm, as in ``{"told": "own", "silent": "none"}``.
        scenes: the episodes.
        fields: other fields of the results.
    """
    found = []
    for arm, done in acts.items():
        outcome, outcomes = goals(arm, done)
        usual = {"policy": policy, "arm": arm, "goals": outcomes, **fields}
        for task in TASKS:
            found += [make_result(outcome, scene, task=task, **usual) for scene in scenes]
    return found


DOES_WHAT_IT_HEARS = {"told": "own", "other-goal": "other", "silent": "none", "scrambled": "none"}
SAME_GOAL_IN_EVERY_ARM = {"told": "own", "other-goal": "own", "silent": "own", "scrambled": "own"}
ALWAYS_THE_OTHER_GOAL = {
    "told": "other",
    "other-goal": "other",
    "silent": "other",
    "scrambled": "other",
}


def run_data_of(*results):
    return RunData(frame_of(*results))


def both_rates(arm_figure):
    return float(arm_figure.rate), float(mean_rate(arm_figure.others))


def figure_named(data, name):
    return next(drawn for drawn in arm_figures(data.frame) if drawn.key.contrast.name == name)


@pytest.mark.parametrize(
    ("acts", "use", "habit"),
    [
        (DOES_WHAT_IT_HEARS, 1.0, 0.0),
        (SAME_GOAL_IN_EVERY_ARM, 0.0, 1.0),
        (ALWAYS_THE_OTHER_GOAL, 0.0, 1.0),
    ],
    ids=["does what it hears", "always its own goal", "always the other goal"],
)
def test_who_follows_the_words_is_told_from_who_does_the_same_whatever_it_hears(acts, use, habit):
    """*Language use* is a difference of two rates in the arm *other-goal*.

    There the instruction states the other goal of the scene. `acts` is the goal that a policy
    reaches in each arm; `use` is how often the other goal is reached, which was stated, and `habit`
    how often the own one is, which was not. Would find one arm counted as another.
    """
    results = results_of_policy("mine", acts)

    found = figure_named(run_data_of(results), "language use")

    assert both_rates(found) == (use, habit)
    assert found.gap.value == use - habit
    assert found.gap.episodes == 24, "12 scenes of 2 tasks"
    assert found.p_holm < 0.001
    assert found.interval.low <= use <= found.interval.high
    low, high = rate_interval(found.others.values())
    assert low <= habit <= high


@pytest.mark.parametrize("contrast", ["words' worth", "order's worth"])
@pytest.mark.parametrize(
    ("acts", "worth"),
    [
        (DOES_WHAT_IT_HEARS, 1.0),
        (SAME_GOAL_IN_EVERY_ARM, 0.0),
    ],
    ids=["does what it hears", "always its own goal"],
)
def test_words_are_worth_what_success_loses_in_silence_and_their_order_when_scrambled(
    contrast, acts, worth
):
    """`acts` is the goal that a policy reaches in each arm; if told or silent, `own` is a success.

    Who does what it hears wins all if told and nothing without words or in a scrambled order: both
    are worth 1. Who does the same in every arm loses nothing.
    """
    found = figure_named(run_data_of(results_of_policy("mine", acts)), contrast)

    assert found.gap.value == worth


def test_the_success_with_paraphrases_is_their_mean_less_that_with_the_instruction():
    """Of 8 episodes in 2 tasks the first paraphrase wins all, the second half: 0.75 on average.

    The instruction itself wins all. Would find paraphrases that are pooled.
    """
    results = [
        *results_of_policy("mine", {"told": "own", "paraphrase-1": "own"}, range(8)),
        *results_of_policy("mine", {"paraphrase-2": "own"}, range(4)),
        *results_of_policy("mine", {"paraphrase-2": "none"}, range(4, 8)),
    ]

    found = figure_named(run_data_of(results), "paraphrases")

    assert both_rates(found) == (0.5, 0.75)
    assert found.gap.value == -0.25
    assert found.gap.episodes == 16


def test_an_episode_that_lacks_a_verdict_in_some_arm_is_left_out():
    """Three scenes of two tasks were played in all arms: six episodes count.

    Scene 7 was played only as told, and scene 8 ended in an error in each arm.
    """
    results = results_of_policy("mine", DOES_WHAT_IT_HEARS, range(3))
    results.append(make_result("success", 7, policy="mine", task=TASKS[0]))
    for arm in DOES_WHAT_IT_HEARS:
        results.append(make_result("error", 8, policy="mine", task=TASKS[0], arm=arm))

    found = figure_named(run_data_of(results), "words' worth")

    assert found.gap.episodes == 6


def results_of_a_policy_that_mostly_listens():
    """Return results with another rate in each arm, and of two policy seeds."""
    reads_order_not = DOES_WHAT_IT_HEARS | {"scrambled": "own"}
    needs_order = SAME_GOAL_IN_EVERY_ARM | {"scrambled": "none"}
    second_seed = SAME_GOAL_IN_EVERY_ARM | {"paraphrase-1": "own"}
    return [
        *results_of_policy("mine", reads_order_not, range(6)),
        *results_of_policy("mine", needs_order, range(6, 9)),
        *results_of_policy("mine", ALWAYS_THE_OTHER_GOAL, range(9, 11)),
        *results_of_policy("mine", {"again": "own"}, range(4, 11)),
        *results_of_policy("mine", second_seed, range(3), policy_seed=1),
        *results_of_policy("mine", {"paraphrase-1": "own", "paraphrase-2": "none"}, range(5)),
        *results_of_policy("mine", {"paraphrase-2": "own"}, range(3), policy_seed=1),
    ]


def test_the_table_of_arms_is_as_stored(snapshot):
    """Of a policy that mostly listens and of one, *knows*, that never does; in two settings."""
    data = run_data_of(
        results_of_a_policy_that_mostly_listens(),
        results_of_policy("knows", SAME_GOAL_IN_EVERY_ARM),
        results_of_policy("mine", SAME_GOAL_IN_EVERY_ARM, range(2), setting="direct"),
        results_of_policy("knows", {"told": "own", "silent-empty": "none"}, setting="direct"),
    )

    assert get_format("markdown").draw(make_arm_table(data)) == snapshot


def test_rates_of_arms_are_rounded_half_up():
    """Of 16 scenes one is solved when told: 6.25 %, which Python rounds to 6.2."""
    results = []
    for scene in range(16):
        outcome = "failure" if scene else "success"
        results.append(make_result(outcome, scene))
        results.append(make_result("failure", scene, arm="silent"))

    (row,) = make_arm_table(RunData(frame_of(results))).rows

    assert str(row.entries[1]).startswith("6.3 (")


def test_sentences_that_compare_the_language_use_of_two_policies_are_as_stored(snapshot):
    mine = frame_of(results_of_a_policy_that_mostly_listens())
    knows = frame_of(results_of_policy("knows", SAME_GOAL_IN_EVERY_ARM))

    assert [*language_use_sentences(mine, knows, ("mine", "knows"))] == snapshot


def test_a_run_without_control_arms_has_neither_their_table_nor_a_sentence_about_them():
    mine = run_data_of(results_of_policy("mine", DOES_WHAT_IT_HEARS))
    told = run_data_of(results_of_policy("knows", {"told": "own"}))

    with pytest.raises(InvalidValueError, match="--arms told"):
        make_arm_table(told)
    assert not [*language_use_sentences(mine.frame, told.frame, ("", ""))]


@pytest.mark.parametrize(
    ("episode", "chance"), [(0, 3 / 9), (3, 1 / 9)], ids=["one container", "two containers"]
)
def test_the_chance_to_guess_a_goal_in_silence_counts_goals_that_begin_alike(episode, chance):
    """Lifting one of three things is a goal; lifting two in order is another: 3 + 6 goals.

    Who lifts the first thing of a pair is right about two pairs, too: 1 of 9 goals, or 3 of 9.
    """
    assert silent_chance("VideoUnmask", "test", episode) == pytest.approx(chance)


def test_the_chance_to_guess_one_of_four_visits_is_a_quarter():
    assert silent_chance("StopCube", "test", 0) == 0.25
