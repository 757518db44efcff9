"""What the figures of control arms show of made-up policies."""

from __future__ import annotations

import pytest
from flat_jobs import frame_of, make_result

from roboirg.analysis.measures.arm_figures import arm_figures, silent_chance
from roboirg.analysis.measures.measure import mean_rate
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.arm_table import language_use_sentences, make_arm_table
from roboirg.analysis.tables.rendering import get_format
from roboirg.core.errors import InvalidValueError
from roboirg.records.record import GoalOutcomes

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
ALWAYS_THE_OTHER_GOAL = dict.fromkeys(DOES_WHAT_IT_HEARS, "other")


def run_data_of(*results):
    return RunData(frame_of(*results))


def both_rates(arm_figure):
    return float(arm_figure.rate), float(mean_rate(arm_figure.others))


def figure_named(data, name):
    return next(drawn for drawn in arm_figures(data.frame) if drawn.key.contrast.name == name)


@pytest.mark.parametrize(
    ("if_own_is_stated", "if_other_is_stated", "each_reached", "same_reached"),
    [("own", "other", 1.0, 0.0), ("own", "own", 0.0, 1.0), ("other", "other", 0.0, 1.0)],
    ids=["does what it hears", "always its own goal", "always the other goal"],
)
def test_who_follows_the_words_is_told_from_who_does_the_same_whatever_it_hears(
    if_own_is_stated, if_other_is_stated, each_reached, same_reached
):
    """Each of 12 scenes of 2 tasks is played twice: its own goal is stated, then another goal.

    Given is which of the two the policy reaches each time, in all scenes alike. *Language use* is
    the share of scenes in which each goal was reached when it was stated, less the share in which
    the same one was reached both times. Would find one arm counted as another.
    """
    reached = {"told": if_own_is_stated, "other-goal": if_other_is_stated}
    results = results_of_policy("mine", reached, scenes=range(12))

    found = figure_named(run_data_of(results), "language use")

    assert both_rates(found) == (each_reached, same_reached)
    assert found.gap.value == each_reached - same_reached
    assert found.gap.episodes == 12 * 2


@pytest.mark.parametrize(
    ("contrast", "arm"), [("words' worth", "silent"), ("order's worth", "scrambled")]
)
@pytest.mark.parametrize(("reached", "worth"), [("none", 1.0), ("own", 0.0)])
def test_words_are_worth_what_success_loses_in_silence_and_their_order_when_scrambled(
    contrast, arm, reached, worth
):
    """With the instruction (`told`) the policy always reaches the scene's own goal: a success.

    Without words, or in a scrambled order, it reaches nothing and loses all, a worth of 1, or still
    its own goal and loses nothing.
    """
    results = results_of_policy("mine", {"told": "own", arm: reached})

    found = figure_named(run_data_of(results), contrast)

    assert found.gap.value == worth


def test_success_with_all_paraphrases_is_compared_with_the_mean_over_paraphrases():
    """Of 8 scenes in each of 2 tasks, the first paraphrase is solved in all, the second in 0 to 3.

    So half of the 16 episodes are solved in both wordings (0.5), and on average 1 and 0.5 (0.75).
    Would find paraphrases that are pooled. Success with the instruction itself (told) has no part.
    """
    results = [
        *results_of_policy("mine", {"told": "own", "paraphrase-1": "own"}, scenes=range(8)),
        *results_of_policy("mine", {"paraphrase-2": "own"}, scenes=range(4)),
        *results_of_policy("mine", {"paraphrase-2": "none"}, scenes=range(4, 8)),
    ]

    found = figure_named(run_data_of(results), "paraphrases")

    assert both_rates(found) == (0.5, 0.75)
    assert found.gap.value == 0.5 - 0.75
    assert found.gap.episodes == 8 * 2


def test_an_episode_that_lacks_a_verdict_in_some_arm_is_left_out():
    """Three scenes of two tasks were played with and without words: six episodes count.

    Scene 7 was played only with words (`told`), and scene 8 ended in an error both times.
    """
    results = results_of_policy("mine", {"told": "own", "silent": "none"}, scenes=range(3))
    results.append(make_result("success", episode=7, policy="mine"))
    for arm in ("told", "silent"):
        results.append(make_result("error", episode=8, policy="mine", arm=arm))

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
    """*mine* mostly follows the words; *knows* does the same whatever is said.

    The sentence has the difference of their language use, its interval and p-value.
    """
    mine = frame_of(results_of_a_policy_that_mostly_listens())
    knows = frame_of(results_of_policy("knows", SAME_GOAL_IN_EVERY_ARM))

    assert [*language_use_sentences(mine, knows, ("mine", "knows"))] == snapshot


def test_a_run_without_control_arms_has_neither_their_table_nor_a_sentence_about_them():
    """Control arms play a scene again, for example without words; here is the usual arm alone."""
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
