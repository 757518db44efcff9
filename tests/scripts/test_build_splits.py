"""The script that selects the seeds of the splits again."""

import json
import re

import build_splits
import pytest
import seed_selection

from roboirg.core.errors import RoboIRGError
from roboirg.tasks.splits.splits import TaskSplits, shipped_splits


def test_the_file_of_splits_is_read_back_and_has_a_line_for_each_task():
    """Two tasks with a checksum each, and with the numbers of seeds that were passed over; two more
    lines are the braces."""
    splits = {"A": TaskSplits("0f", {"train/3": 2}), "B": TaskSplits("ff", {})}
    text = seed_selection.splits_text(splits)

    assert len(text.splitlines()) == 4
    assert {task: TaskSplits(**entry) for task, entry in json.loads(text).items()} == splits


def test_splits_are_built_anew_for_what_is_named(tmp_path, monkeypatch, capsys):
    """`find` stands in for the search in several processes, and gives seeds in the wrong order.
    Three tasks have 150 episodes in the split; only the 52 that RoboMME has not published need a
    seed. What is built must be the shipped file, printed or written."""

    def find(slots, workers):
        assert workers == 0
        # Backwards: no order of ending may matter.
        return (
            seed_selection.find_seed(slot, seed_selection.check_words) for slot in reversed(slots)
        )

    monkeypatch.setattr(seed_selection, "find_seeds", find)
    chosen = {"tasks": "VideoPlaceOrder,PickXtimes,PutInBox", "split": "val", "workers": 0}
    build_splits.build_splits(**chosen)
    printed = capsys.readouterr()

    assert printed.out == seed_selection.splits_text(shipped_splits())
    assert re.search(r"VideoPlaceOrder/val/\d+: seed \d+ is rejected, no room", printed.err)
    assert "episodes 52/52" in printed.err  # the other 98 are published

    build_splits.build_splits(**chosen, out=str(tmp_path / "splits.json"))
    assert (tmp_path / "splits.json").read_text() == printed.out


@pytest.mark.parametrize(
    ("chosen", "sentence"),
    [
        ({"tasks": "PickXtime"}, "There is no task 'PickXtime'"),
        ({"split": "dev"}, "There is no split 'dev'"),
        ({"workers": -1}, "workers is -1"),
        ({"out": "nowhere/splits.json"}, "There is no folder for 'nowhere/"),
    ],
)
def test_what_is_wrong_is_refused(chosen, sentence):
    with pytest.raises(RoboIRGError, match=re.escape(sentence)):
        build_splits.build_splits(**chosen)
