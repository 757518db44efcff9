"""Flips between two runs of the same plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboirg.apps.leaderboard.repeats import (
    count_flips,
    flips_by_cell,
    repeated_episodes,
    told_arithmetic,
    write_flips,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences
from roboirg.evaluation.analysis.stats.flips import FLIPS_FILE, read_flips
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record
from roboirg.evaluation.records.action_log import ActionLog, write_actions
from roboirg.evaluation.records.record import Job
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore, read_results


def write_run(folder: Path, outcomes: str, rows: dict[int, np.ndarray] | None = None) -> Path:
    """Store an episode for each letter: s, f or e; `rows` replaces an episode's actions."""
    with RecordStore(folder) as store:
        for episode, letter in enumerate(outcomes):
            setting = "direct" if episode % 2 else "explicit"
            job = Job(
                policy="p",
                task="StopCube",
                split="test",
                episode=episode,
                options=InstructionOptions(setting),
            )
            result = RolloutResult()
            result.cause = None if letter == "s" else "it failed"
            result.outcome = {"s": "success", "f": "failure", "e": "error"}[letter]  # type: ignore[assignment]
            taken = (rows or {}).get(episode, np.zeros((4, 8)))
            log = ActionLog("joint_angle", taken, np.zeros(1, np.int32), np.zeros(1))
            digest = write_actions(log, folder)
            store.append(make_record(job, result, started_at="", action_log=digest))
    return folder


def test_counts(tmp_path: Path) -> None:
    changed = np.zeros((4, 8))
    changed[2, 5] = 1e-9
    one = write_run(tmp_path / "one", "ssfffse")
    two = write_run(tmp_path / "two", "sfsffss", {1: changed, 3: np.zeros((6, 8))})
    found = repeated_episodes(one, two)
    counts = count_flips(found)
    assert (counts.both, counts.neither, counts.lost, counts.gained) == (2, 2, 1, 1)
    assert (counts.flips, counts.verdicts, counts.errors) == (2, 6, 1)
    assert counts.acted_differently == 2
    assert [episode.differs_at for episode in found] == [None, 2, None, 4, None, None, None]
    assert [episode.is_flip for episode in found].count(True) == 2
    cells = flips_by_cell(found)
    assert {options.setting: one.flips for (_, options), one in cells.items()} == {
        "explicit": 1,
        "direct": 1,
    }


def test_only_shared_episodes_count(tmp_path: Path) -> None:
    one, two = write_run(tmp_path / "one", "sss"), write_run(tmp_path / "two", "s")
    assert len(repeated_episodes(one, two)) == 1


def test_runs_without_a_shared_episode_are_refused(tmp_path: Path) -> None:
    one = write_run(tmp_path / "one", "s")
    two = tmp_path / "two"
    with RecordStore(two) as store:
        job = Job(
            policy="other",
            task="StopCube",
            split="test",
            episode=0,
            options=InstructionOptions("explicit"),
        )
        store.append(make_record(job, RolloutResult(), started_at=""))
    with pytest.raises(InvalidValueError, match="no episode in common"):
        repeated_episodes(one, two)


def test_a_comparison_tells_how_much_a_policy_differs_from_itself(tmp_path: Path) -> None:
    one = write_run(tmp_path / "one", "ssffss")
    two = write_run(tmp_path / "two", "sfsfss")
    counted = flips_by_cell(repeated_episodes(one, two))
    write_flips(counted, one)
    assert read_flips(one) == counted
    assert read_flips(two) == {}
    cells = gather([("one", read_results(one))])
    found = compare(cells, cells)
    known, unknown = read_flips(one), read_flips(two)
    text = "\n".join(sentences(found, "p", "q", (known, unknown)))
    assert "explicit: no clear difference" in text
    assert "Verdicts that change between repeated runs: p 33.3 % (1 of 3)." in text
    assert "not known of q" in text
    text = "\n".join(sentences(found, "p", "q", (known, known)))
    assert "p 33.3 % (1 of 3), q 33.3 % (1 of 3)" in text
    assert "not known" not in text
    assert "by themselves" not in "\n".join(sentences(found, "p", "q"))
    (one / FLIPS_FILE).write_text("{")
    with pytest.raises(StoreError, match="damaged"):
        read_flips(one)


def test_what_a_server_tells_of_its_arithmetic() -> None:
    told = {"server": "here:8000", "device": "GPU", "driver": "570.1", "flags": "XLA_FLAGS=-x"}
    assert told_arithmetic(told) == "device GPU, driver 570.1, flags XLA_FLAGS=-x"
    assert told_arithmetic({"planner": {}, "policy": told}) == told_arithmetic(told)
    assert told_arithmetic({"server": "here:8000", "policy": "random"}) == ""
