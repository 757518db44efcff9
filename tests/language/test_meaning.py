"""The declared meaning of an instruction: which goals of the scene its words leave open.

A `Meaning` has a `Term` for each field of the goal. `Term("rank", ("red", "blue"), rank=2)` says
that the color is the second of two that were listed, as in *red and blue … take the latter*.
"""

import itertools
from fractions import Fraction

import pytest

from roboirg.apps.language_lab.scenarios.scenario_check import scenes_of
from roboirg.core.delivery import DELIVERIES
from roboirg.core.episode import Goal
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import instruct, instruct_with, meaning
from roboirg.language.arms import say_arm
from roboirg.language.generator import find_refusal
from roboirg.language.instruction import Described, Meaning, Term
from roboirg.language.landmarks import candidates_in
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.settings import settings_of
from roboirg.shortcuts.command_chance import (
    blind_goals,
    goals_of_command,
    is_right,
    right_share,
    understood_goals,
)
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.splits.splits import get_episode

WRITTEN = [*written_words()]
each_task = pytest.mark.parametrize("task", WRITTEN)
ONE_CUBE = get_episode("PickXtimes", "test", 0)
"""One green cube, to be placed on the target once to five times."""
THREE_CUBES = get_episode("PickXtimes", "test", 3)
"""A red, a green and a blue cube; one is to be placed on the target two to five times."""


@pytest.mark.parametrize(
    "repeats",
    [
        Term("same", (4,)),
        Term("rank", (4, 5), rank=1),
        Term("rank", (2, 4), rank=2),
        Term("other", (5, 4), rank=1),
        Term("double", (2,)),
        Term("half", (8,)),
        Term("step", (6,), step=-2),
    ],
    ids=[
        "four", "four or five, the former", "two or four, the latter",
        "five or four, not the former", "twice as often as two", "half of eight",
        "two fewer than six",
    ],
)  # fmt: skip
def test_each_operation_on_numbers_leads_to_four_repetitions(repeats):
    """The words say *the blue cube*, and a number in one of seven ways; `ids` say them in words.

    For example, *rank 2* of (2, 4) is *two or four, the latter*, and a *step* of -2 from 6 is *two
    fewer than six*. Each way gives 4; the scene has three cubes, of which one is blue.
    """
    words = Meaning({"color": Term("same", ("blue",)), "repeats": repeats})
    assert meaning.meant_goals(words, THREE_CUBES) == (Goal.of(color="blue", repeats=4),)


def test_neither_red_nor_green_means_the_blue_cube():
    """The operation "without" leaves the colors of the scene that were not named."""
    color = Term("without", ("red", "green"))
    words = Meaning({"color": color, "repeats": Term("same", (4,))})
    assert meaning.meant_goals(words, THREE_CUBES) == (Goal.of(color="blue", repeats=4),)


def test_a_place_that_selects_no_object_means_no_goal():
    """Words that the scene does not bear out must not be guessed at."""
    color = Term("same", (Described("no such place", "place", "robot"),))
    words = Meaning({"color": color, "repeats": Term("same", (1,))})
    assert meaning.meant_goals(words, ONE_CUBE) == ()


def every_instruction(task, step):
    """Yield (episode, options, instruction) for every ``step``-th published episode of a task.

    The options are all settings, forms, pools of wordings and deliveries that can express it.
    """
    for episode in scenes_of(task, 0)[::step]:
        for setting, form, pool, delivery in itertools.product(
            settings_of(get_task(task)), ("implicit", "resolved"), POOLS, DELIVERIES
        ):
            options = InstructionOptions(setting, form, wordings=pool, delivery=delivery)
            if find_refusal(episode, options) is None:
                yield episode, options, instruct_with(episode, options)


@pytest.fixture(
    scope="module",
    params=[
        *(pytest.param((task, 10), id=task) for task in WRITTEN),
        *(pytest.param((task, 1), id=f"{task}-all", marks=pytest.mark.slow) for task in WRITTEN),
    ],
)
def published(request):
    """Every instruction of every tenth published episode of a task, or (slow) of all of them.

    A list of (episode, options, instruction).
    """
    return list(every_instruction(*request.param))


def mean_the_right_goal(goals, episode):
    """Return whether there are goals, and all of them are the episode's as far as judged."""
    return bool(goals) and all(is_right(goal, episode) for goal in goals)


def test_an_instruction_means_the_goal_of_its_episode_and_no_other_goal(published):
    """The sentences together, from the introduction to the command."""
    for episode, _, said in published:
        assert mean_the_right_goal(understood_goals(said, episode), episode), said.text


def test_the_command_alone_leaves_the_right_goal_open_and_guessers_choose_among_some(published):
    """*Take the latter* alone leaves all colors, and a guesser who heard *red and blue* two."""
    for episode, _, said in published:
        of_command = set(goals_of_command(said, episode))
        of_guesser = set(blind_goals(said, episode))
        assert {episode.goal} <= of_guesser <= of_command, said.text


def test_explicit_and_resolved_commands_mean_the_right_goal_without_their_introduction(published):
    """Their last sentence states every value; only *implicit* ones point back at what was said."""
    for episode, options, said in published:
        if options.setting == "explicit" or options.form == "resolved":
            goals = goals_of_command(said, episode)
            assert mean_the_right_goal(goals, episode), said.text


def test_where_two_values_are_offered_no_singular_gives_the_number_one_away(published):
    """After *once or twice*, *for that time* would tell that once is meant."""
    for _, options, said in published:
        if options.setting == "direct-rival" and options.form == "implicit":
            assert not any(said.meaning.agrees.values()), said.text


@pytest.mark.parametrize(
    ("speaks_of_one", "repeats"), [(True, {1}), (False, {2, 3, 4, 5})], ids=["True", "False"]
)
def test_singular_words_leave_the_goals_of_one_and_plural_words_the_others(speaks_of_one, repeats):
    """*Once for that take*, or *for each take*; the three colors stay open."""
    words = Meaning({}, agrees={"repeats": speaks_of_one})

    left = meaning.command_goals(words, THREE_CUBES)

    assert {goal["repeats"] for goal in left} == repeats
    assert {goal["color"] for goal in left} == {"red", "green", "blue"}


@pytest.mark.parametrize(
    ("setting", "field", "other", "goal"),
    [
        ("explicit", "color", "red", Goal.of(color="red", repeats=4)),
        ("explicit", "repeats", 2, Goal.of(color="blue", repeats=2)),
        ("direct", "repeats", 3, Goal.of(color="blue", repeats=3)),
    ],
)
def test_changing_a_value_that_was_said_changes_the_goal_that_is_meant(setting, field, other, goal):
    """The goal is the blue cube, four times, and another value is put in its place.

    Would find a meaning that is declared as a constant instead of by what was said.
    """
    said = instruct(THREE_CUBES, setting).meaning
    changed = said.terms[field]._replace(operands=(other,))

    meant = meaning.meant_goals(Meaning({**said.terms, field: changed}), THREE_CUBES)

    assert meant == (goal,)


@pytest.mark.parametrize("setting", ["direct", "spatial", "contextual", "reasoning"])
def test_a_command_that_points_at_values_nobody_introduced_means_no_goal(setting):
    """*Grab it* means nothing if no cube was mentioned: the terms lose what they refer to."""
    said = instruct(ONE_CUBE, setting)
    unsaid = {field: term._replace(operands=()) for field, term in said.meaning.terms.items()}
    assert meaning.meant_goals(Meaning(unsaid), ONE_CUBE) == ()


def test_a_silent_command_leaves_all_goals_open():
    """*Please do your task* states no goal."""
    said = say_arm(ONE_CUBE, InstructionOptions("direct"), "silent").instruction
    assert understood_goals(said, ONE_CUBE) == goals_of(ONE_CUBE)


def test_scrambled_words_mean_no_goal():
    """Words in random order have no declared meaning."""
    said = say_arm(ONE_CUBE, InstructionOptions("direct"), "scrambled").instruction

    assert said.meaning is None
    assert understood_goals(said, ONE_CUBE) == ()
    assert goals_of_command(said, ONE_CUBE) == ()
    assert right_share(blind_goals(said, ONE_CUBE), ONE_CUBE) is None


def test_a_guesser_who_heard_two_values_chooses_between_two_goals():
    """*Nora says once, and my aunt says three times … do what my aunt says.*

    Who does not understand the last part is right in one of two cases; who hears only the command,
    in one of five.
    """
    said = instruct(ONE_CUBE, "direct-rival")

    assert blind_goals(said, ONE_CUBE) == (
        Goal.of(color="green", repeats=1),
        Goal.of(color="green", repeats=3),
    )
    assert right_share(goals_of_command(said, ONE_CUBE), ONE_CUBE) == Fraction(1, 5)


def one_blue_and_three_reds(settled=()):
    """Return what *one blue cube and three red ones* means; `settled` is what the command says."""
    terms = {
        "colors.0": Term("same", ("blue",)),
        "counts.0": Term("same", (1,)),
        "colors.1": Term("same", ("red",)),
        "counts.1": Term("same", (3,)),
    }
    return Meaning(terms, frozenset(settled))


def test_amounts_of_two_colors_mean_the_same_goal_in_either_order():
    """The goal lists its colors in another order than the words: three red and one blue."""
    episode = get_episode("BinFill", "test", 3)
    goal = Goal.of(colors=("red", "blue"), counts=(3, 1))
    assert goal in goals_of(episode)
    assert meaning.meant_goals(one_blue_and_three_reds(), episode) == (goal,)


def test_a_command_that_states_no_amount_leaves_every_goal_open():
    """*Put them into the bin* fits any number of cubes of any colors."""
    episode = get_episode("BinFill", "test", 3)
    assert meaning.command_goals(one_blue_and_three_reds(), episode) == goals_of(episode)


def test_a_command_that_states_one_color_and_both_counts_leaves_the_other_color_open():
    """*One of hers and three red ones* leaves blue and green in this scene."""
    episode = get_episode("BinFill", "test", 3)
    stated = one_blue_and_three_reds(settled=("counts.0", "colors.1", "counts.1"))

    assert set(meaning.command_goals(stated, episode)) == {
        Goal.of(colors=("red", "blue"), counts=(3, 1)),
        Goal.of(colors=("red", "green"), counts=(3, 1)),
    }


def test_all_cubes_but_three_means_the_number_of_cubes_minus_three():
    """BinFill's grounded words say how many cubes stay, *keep three*, and the rest is counted."""
    kept = 0
    for episode, options, said in every_instruction("BinFill", 1):
        if options.setting == "grounded" and said.meaning.terms["counts.0"].operation == "without":
            cubes = candidates_in(episode.scene, "cube")
            assert episode.goal["counts"] == (len(cubes) - 3,), said.text
            kept += 1
    assert kept
