"""All commands that state their values are read in the scenes of the benchmark, and no others."""

import itertools

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
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


def instruction_or_none(task, split, index, options):
    """Return an episode and an instruction, or None where the task or the scene refuses it."""
    episode = get_episode(task, split, index)
    try:
        if find_refusal(episode, options) is not None:
            return episode, None
    except InvalidValueError:  # the task has no such setting
        return episode, None
    return episode, instruct_with(episode, options)


def check_that_all_are_read(task, split, index):
    for options in OPTIONS_THAT_STATE_THE_GOAL:
        episode, instruction = instruction_or_none(task, split, index, options)
        if instruction is None:
            continue
        found = interpret(instruction.text, episode.scene, task)
        assert found == ((episode.goal,), (), ()), instruction.text


@pytest.mark.parametrize("task", every_task())
def test_our_commands_that_state_the_whole_goal_are_read_as_that_goal(task):
    """The interpreter is built without our words, so this checks both."""
    for split, index in itertools.product(POOLS, range(0, 50, 6)):
        check_that_all_are_read(task, split, index)


@pytest.mark.slow
@pytest.mark.parametrize("task", every_task())
def test_our_commands_that_state_the_whole_goal_are_read_in_every_scene(task):
    for split, index in itertools.product(POOLS, range(50)):
        check_that_all_are_read(task, split, index)


@pytest.mark.parametrize("task", every_task())
def test_our_commands_that_leave_a_value_open_are_never_read_as_a_wrong_goal(task):
    for index, setting in itertools.product(range(0, 50, 9), setting_names()):
        for form in ("implicit", "resolved"):
            options = InstructionOptions(setting, form)
            episode, instruction = instruction_or_none(task, "test", index, options)
            if instruction is not None:
                found = interpret(instruction.text, episode.scene, task)
                assert not found.goals or episode.goal in found.goals, instruction.text
