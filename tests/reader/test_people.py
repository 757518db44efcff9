"""Sentences as people type them are understood, or refused by name; none is misread."""

from pathlib import Path

import pytest
from goal_text import goal_text

from roboirg.reader import interpret
from roboirg.tasks.splits import get_episode

PEOPLE = Path(__file__).parent / "people"


def commands_of_people(file):
    """Yield (task, index of the test episode, goal, text) for each sentence of a file.

    A section ``[PickXtimes 2 child]`` has lines such as ``red 2 | Put the red cube on the target
    twice.`` The goal is ``?`` where the person meant nothing clear.
    """
    for line in (PEOPLE / file).read_text().splitlines():
        if line.startswith("["):
            task, index, _ = line.strip("[]").split()
        elif line and not line.startswith("#"):
            yield task, int(index), *line.split(" | ", 1)


def readings_of(file):
    """Yield for each sentence of a file its text, its goal, and what the interpreter makes of it.

    That is a goal in the same notation, or None if it refuses the sentence with a reason.
    """
    for task, index, goal, text in commands_of_people(file):
        found = interpret(text, get_episode(task, "test", index).scene, task)
        if len(found.goals) == 1 and not found.not_understood:
            yield text, goal, goal_text(found.goals[0])
        else:
            assert found.not_understood, text
            yield text, goal, None


@pytest.mark.parametrize("file", ["sentences.txt", "held_out.txt"])
def test_no_command_written_by_people_is_misread(file):
    """A sentence that is understood means the goal that the person meant; none of these is `?`."""
    for text, meant, read in readings_of(file):
        assert read in (meant, None), text


@pytest.mark.parametrize(
    ("file", "count", "least"), [("sentences.txt", 300, 186), ("held_out.txt", 100, 56)]
)
def test_more_than_half_of_the_commands_written_by_people_are_understood(file, count, least):
    """The others are refused with a reason."""
    read = [goal for _, _, goal in readings_of(file)]

    assert len(read) == count
    assert count - read.count(None) >= least
