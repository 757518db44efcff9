"""Sentences as people type them are understood, or refused by name; none is misread."""

from collections import Counter
from pathlib import Path

import pytest

from roboirg.reader import interpret
from roboirg.tasks.splits import get_episode

PEOPLE = Path(__file__).parent / "people"
UNDERSTOOD = {"sentences": 186, "held_out": 56}
"""Sentences that are understood at least."""


def commands_of_people(name):
    """Yield task, episode, expected goal (``?``: to be refused) and sentence."""
    task = index = ""
    for line in (PEOPLE / f"{name}.txt").read_text().splitlines():
        if line.startswith("["):
            task, index, _ = line.strip("[]").split()
        elif line and not line.startswith("#"):
            yield task, int(index), *line.split(" | ", 1)


def goal_in_the_file_s_notation(goal):
    """Return a goal in the notation of the files."""
    slots = goal.as_mapping()
    if "counts" in slots:
        pairs = zip(slots["colors"], slots["counts"], strict=True)
        return " ".join(f"{color} {count}" for color, count in pairs)
    values = (slot if isinstance(slot, tuple) else (slot,) for slot in slots.values())
    return " ".join(str(part) for slot in values for part in slot)


@pytest.mark.parametrize("name", UNDERSTOOD)
def test_no_command_written_by_people_is_misread_and_most_are_understood(name):
    """400 sentences, each with the goal that was meant, or `?` where nothing clear was."""
    verdicts = Counter()
    for task, index, goal, text in commands_of_people(name):
        found = interpret(text, get_episode(task, "test", index).scene, task)
        if len(found.goals) == 1 and not found.not_understood:
            assert goal_in_the_file_s_notation(found.goals[0]) == goal, text
            verdicts["understood"] += 1
        else:
            assert found.not_understood, text
            verdicts["refused"] += 1

    assert verdicts.total() == {"sentences": 300, "held_out": 100}[name]
    assert verdicts["understood"] >= UNDERSTOOD[name], verdicts
