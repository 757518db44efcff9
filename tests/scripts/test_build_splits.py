"""The script that selects the seeds of the splits again."""

import json
import re
from pathlib import Path

import build_splits
import pytest
import seed_selection

from roboirg.core.errors import RoboIRGError
from roboirg.tasks.splits.splits import TaskSplits, shipped_splits


def test_the_file_of_splits_is_read_back_and_has_a_line_for_each_task():
    """The file holds, for two tasks, a checksum of the episodes and the numbers of seeds that were
    passed over; each task is one line, and two more lines are the braces of the JSON object."""
    splits = {"A": TaskSplits("0f", {"train/3": 2}), "B": TaskSplits("ff", {})}

    text = seed_selection.splits_text(splits)

    assert len(text.splitlines()) == 2 + 2
    assert {task: TaskSplits(**entry) for task, entry in json.loads(text).items()} == splits


@pytest.fixture
def search_that_ends_with_the_first_episode(monkeypatch):
    """Search in this process instead of several, and yield the seeds of the last episode first."""

    def find_seeds(slots, workers):
        assert workers == 0
        for slot in reversed(slots):
            yield seed_selection.find_seed(slot, seed_selection.check_words)

    monkeypatch.setattr(seed_selection, "find_seeds", find_seeds)


def test_splits_that_are_built_anew_are_as_they_are_shipped(
    search_that_ends_with_the_first_episode, tmp_path
):
    """The program that made the shipped file of seeds selects them again for two tasks, and
    keeps those of the others. As nothing has changed since, the result is that file, in whatever
    order the searches for single episodes end (here: backwards)."""
    file = tmp_path / "splits.json"

    build_splits.build_splits(tasks="VideoPlaceOrder,PickXtimes", workers=0, out=file)

    assert file.read_text() == seed_selection.splits_text(shipped_splits())


def test_building_splits_reports_each_rejected_seed_and_its_progress(
    search_that_ends_with_the_first_episode, tmp_path, capsys
):
    """Of the 200 episodes of VideoPlaceOrder RoboMME has published 195, whose seeds are known.
    Seeds are searched for the other five, and the scenes of some have no room for all things."""
    build_splits.build_splits(tasks="VideoPlaceOrder", workers=0, out=tmp_path / "splits.json")

    reported = capsys.readouterr().err
    assert re.search(r"VideoPlaceOrder/val/\d+: seed \d+ is rejected, no room", reported)
    assert "episodes 5/5" in reported


@pytest.mark.parametrize(
    ("chosen", "sentence"),
    [
        ({"tasks": "PickXtime"}, "There is no task 'PickXtime'"),
        ({"workers": -1}, "workers is -1"),
        ({"out": Path("nowhere/splits.json")}, "There is no folder for 'nowhere/"),
    ],
)
def test_what_is_wrong_is_refused(chosen, sentence):
    """An unknown task, a negative number of processes and a folder that is not there are refused in
    a sentence that names the value."""
    with pytest.raises(RoboIRGError, match=re.escape(sentence)):
        build_splits.build_splits(**chosen)
