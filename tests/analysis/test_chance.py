"""The expected success of the listeners against the listeners themselves, and by hand."""

from __future__ import annotations

from fractions import Fraction

import pytest
from flat_jobs import job_of

from roboirg.analysis.measures.chance import CHANCE, floor_level
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.tasks import all_tasks


def job_in(task, setting, episode, **fields):
    """Return a job of the test split; who plays it does not matter here."""
    usual = {"policy": "any", "split": "test", **fields}
    return job_of(task=task, setting=setting, episode=episode, **usual)


@pytest.mark.parametrize(
    ("task", "setting", "episode", "chance"),
    [
        ("PickXtimes", "spatial", 2, Fraction(1, 3)),
        ("VideoUnmask", "direct", 2, Fraction(1, 3)),
        ("BinFill", "reasoning", 4, Fraction(1, 5)),
        ("StopCube", "reasoning", 3, Fraction(1, 4)),
        ("StopCube", "reasoning", 2, Fraction(1, 2)),
    ],
    ids=["a place", "it", "his", "one pass earlier", "either the second or the third"],
)
def test_the_chance_level_is_that_of_a_guess_among_the_goals_that_the_command_leaves_open(
    task, setting, episode, chance
):
    """Three cubes are as likely, five amounts, or four visits, unless the context names two."""
    assert floor_level(CHANCE, [job_in(task, setting, episode)]) == chance


@pytest.mark.parametrize(
    ("rule", "level"),
    [("first-mention", 0), ("last-mention", 0), ("elimination", Fraction(1, 3)), ("surface", 1)],
)
def test_the_floor_of_a_shortcut_is_how_often_its_guess_is_right(rule, level):
    """*Yesterday, we stopped the cube the third time …: push the button one pass earlier.*

    The second of four visits is meant: the only one named is wrong, and three are left if it is
    eliminated. The rule "surface" understands *one earlier*.
    """
    assert floor_level(rule, [job_in("StopCube", "reasoning", 3)]) == level


def test_the_chance_level_of_several_jobs_is_their_mean():
    """A half and a quarter."""
    jobs = [job_in("StopCube", "reasoning", 2), job_in("StopCube", "reasoning", 3)]

    assert floor_level(CHANCE, jobs) == Fraction(3, 8)


def test_an_episode_counts_once_however_many_policies_and_seeds_play_it():
    """Chance is 1 / 2 in episode 2 and 1 / 4 in episode 3, a mean of 3 / 8.

    If the three jobs of episode 2 counted three times, it would be 7 / 16.
    """
    first = job_in("StopCube", "reasoning", 2)
    again = job_in("StopCube", "reasoning", 2, policy="else", policy_seed=3)
    other = job_in("StopCube", "reasoning", 3)

    assert floor_level(CHANCE, [first, again, again, other]) == Fraction(3, 8)


@pytest.mark.parametrize(
    ("setting", "form"),
    [("explicit", "implicit"), ("direct", "resolved"), ("contextual", "resolved")],
)
def test_a_command_that_names_everything_leaves_nothing_to_guess(setting, form):
    """Explicit commands, and the *resolved* form, in which what they refer to is named."""
    for task in all_tasks():
        jobs = [job_in(task, setting, episode, form=form) for episode in range(4)]

        assert floor_level(CHANCE, jobs) == 1, task


def test_no_jobs_have_no_chance_level():
    assert floor_level(CHANCE, []) is None


@pytest.mark.parametrize(
    ("options", "language_version", "is_known"),
    [
        ({}, LANGUAGE_VERSION, True),
        ({"stages": (1, 5)}, LANGUAGE_VERSION, False),
        ({}, "0.9", False),
    ],
    ids=["measured", "a shorter context", "an older language version"],
)
def test_a_learned_floor_is_known_only_for_the_kind_of_instruction_that_it_was_measured_on(
    options, language_version, is_known
):
    """The floor *text-only* is the success of a learner that guesses the goal from words alone.

    The package has it for the current version of the language, with all five stages of a context.
    A context of stages 1 and 5 alone, or version 0.9, was not measured: the result is None instead
    of the success with other instructions.
    """
    job = job_in("PickXtimes", "contextual", episode=2, **options)

    level = floor_level("text-only", [job], language_version)

    assert (level is not None) == is_known
