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

STATED = (
    InstructionOptions(),
    InstructionOptions("direct", "resolved"),
    InstructionOptions("contextual", "resolved"),
    InstructionOptions("contextual", "resolved", distractor="competing"),
    InstructionOptions("spatial", "resolved"),
    InstructionOptions("spatial", "resolved", frame="camera"),
)


def said(task, split, index, options):
    """Return an episode and an instruction, or None where the task or the scene refuses it."""
    episode = get_episode(task, split, index)
    try:
        if find_refusal(episode, options) is not None:
            return episode, None
    except InvalidValueError:  # the task has no such setting
        return episode, None
    return episode, instruct_with(episode, options)


def check(task, split, index):
    for options in STATED:
        episode, instruction = said(task, split, index, options)
        if instruction is None:
            continue
        found = interpret(instruction.text, episode.scene, task)
        assert found == ((episode.goal,), (), ()), instruction.text


@pytest.mark.parametrize("task", every_task())
def test_commands_that_state_their_values_are_read(task):
    for split, index in itertools.product(POOLS, range(0, 50, 6)):
        check(task, split, index)


@pytest.mark.slow
@pytest.mark.parametrize("task", every_task())
def test_commands_that_state_their_values_are_read_in_every_scene(task):
    for split, index in itertools.product(POOLS, range(50)):
        check(task, split, index)


@pytest.mark.parametrize("task", every_task())
def test_other_forms_are_refused_or_leave_the_goal_open(task):
    for index, setting in itertools.product(range(0, 50, 9), setting_names()):
        for form in ("implicit", "resolved"):
            options = InstructionOptions(setting, form)
            episode, instruction = said(task, "test", index, options)
            if instruction is not None:
                found = interpret(instruction.text, episode.scene, task)
                assert not found.goals or episode.goal in found.goals, instruction.text
