"""All commands that state their values are read in the scenes of the benchmark, and no others."""

import itertools

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.settings import setting_names
from roboirg.reader import interpret
from roboirg.tasks import every_task
from roboirg.tasks.splits import get_episode

OPTIONS_THAT_STATE_THE_GOAL = (
    InstructionOptions(),
    InstructionOptions("direct", "resolved"),
    InstructionOptions("contextual", "resolved"),
    InstructionOptions("contextual", "resolved", distractor="competing"),
    InstructionOptions("spatial", "resolved"),
    InstructionOptions("spatial", "resolved", frame="camera"),
)


def said_in(task, split, index, options):
    """Return an episode and its instruction; None where the task or the scene refuses the options.

    A task that has no such setting raises an error instead of giving a reason.
    """
    episode = get_episode(task, split, index)
    try:
        refusal = find_refusal(episode, options)
    except InvalidValueError:
        return None
    return None if refusal else (episode, instruct_with(episode, options))


def check_that_the_goal_is_read(task, split, index):
    """Check that the interpreter reads the goal from what is said of an episode, and nothing else
    in each of the ways to say it that state every value of the goal."""
    for options in OPTIONS_THAT_STATE_THE_GOAL:
        told = said_in(task, split, index, options)
        if told is not None:
            episode, said = told
            found = interpret(said.text, episode.scene, task)
            assert found == ((episode.goal,), (), ()), said.text


@pytest.mark.parametrize("task", every_task())
def test_our_commands_that_state_the_whole_goal_are_read_as_that_goal(task):
    """The interpreter is built without our words, so this checks both, in every sixth episode."""
    for split, index in itertools.product(("train", "test"), range(0, 50, 6)):
        check_that_the_goal_is_read(task, split, index)


@pytest.mark.slow
@pytest.mark.parametrize("task", every_task())
def test_our_commands_that_state_the_whole_goal_are_read_in_every_scene(task):
    for split, index in itertools.product(("train", "test"), range(50)):
        check_that_the_goal_is_read(task, split, index)


@pytest.mark.parametrize("form", ["implicit", "resolved"])
@pytest.mark.parametrize("task", every_task())
def test_our_commands_that_leave_a_value_open_are_never_read_as_a_wrong_goal(task, form):
    """Commands that point back, such as *Lift it twice*, leave no goal, or the right one."""
    for index, setting in itertools.product(range(0, 50, 9), setting_names()):
        told = said_in(task, "test", index, InstructionOptions(setting, form))
        if told is not None:
            episode, said = told
            found = interpret(said.text, episode.scene, task)
            assert not found.goals or episode.goal in found.goals, said.text
