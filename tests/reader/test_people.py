"""Sentences as people type them are understood, or refused by name; none is misread."""

from pathlib import Path
from typing import NamedTuple

import pytest

from roboirg.reader import interpret
from roboirg.tasks.splits import get_episode

PEOPLE = Path(__file__).parent / "people"


class TypedCommand(NamedTuple):
    """A sentence of a file, ``red 2 | Put the red cube on the target twice.``, with its section.

    Attributes:
        task: whose scene the person saw.
        index: of the episode in the test split.
        goal: the values of the goal that was meant; ``?`` where nothing clear was.
        text: the sentence.
    """

    task: str
    index: int
    goal: str
    text: str


def commands_of_people(file):
    """Return the sentences of a file, whose sections begin with ``[TASK INDEX PERSON]``."""
    found = []
    for line in (PEOPLE / file).read_text().splitlines():
        if line.startswith("["):
            task, index, _ = line.strip("[]").split()
        elif line and not line.startswith("#"):
            found.append(TypedCommand(task, int(index), *line.split(" | ", 1)))
    return found


def in_the_file_s_notation(goal):
    """Return a goal as the files write it: ``red 2``; ``red 3 green 1`` for BinFill."""
    if "counts" in goal.as_mapping():
        return " ".join(f"{color} {count}" for color, count in goal.amounts)
    words = []
    for value in goal.as_mapping().values():
        words += value if isinstance(value, tuple) else [value]
    return " ".join(map(str, words))


def understood_commands(file):
    """Return the sentences of a file that the interpreter understands, each with the goal."""
    found = []
    for command in commands_of_people(file):
        scene = get_episode(command.task, "test", command.index).scene
        read = interpret(command.text, scene, command.task)
        if len(read.goals) == 1 and not read.not_understood:
            found.append((command, read.goals[0]))
    return found


@pytest.mark.parametrize(("file", "count"), [("sentences.txt", 300), ("held_out.txt", 100)])
def test_the_files_have_400_sentences_of_people(file, count):
    assert len(commands_of_people(file)) == count


@pytest.mark.parametrize("file", ["sentences.txt", "held_out.txt"])
def test_no_command_written_by_people_is_misread(file):
    """A sentence that is understood means the goal that the person meant; none is a ``?``."""
    for command, goal in understood_commands(file):
        assert in_the_file_s_notation(goal) == command.goal, command.text


@pytest.mark.parametrize(("file", "least"), [("sentences.txt", 186), ("held_out.txt", 56)])
def test_more_than_half_of_the_commands_written_by_people_are_understood(file, least):
    assert len(understood_commands(file)) >= least


@pytest.mark.parametrize("file", ["sentences.txt", "held_out.txt"])
def test_a_command_written_by_people_that_is_not_understood_is_refused_with_a_reason(file):
    for command in commands_of_people(file):
        scene = get_episode(command.task, "test", command.index).scene
        found = interpret(command.text, scene, command.task)
        assert len(found.goals) == 1 or found.not_understood, command.text
