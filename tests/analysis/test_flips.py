"""Flips between two runs of the same plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboirg.analysis.stats.flips import count_flips, flips_by_cell, repeated_episodes
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.rollout_result import RolloutResult, make_record
from roboirg.records.action_log import ActionLog, write_actions
from roboirg.records.record import Job
from roboirg.records.store import RecordStore


def write_run(folder: Path, outcomes: str, rows: dict[int, np.ndarray] | None = None) -> Path:
    """Store an episode for each letter: s, f or e; `rows` replaces an episode's actions."""
    with RecordStore(folder) as store:
        for episode, letter in enumerate(outcomes):
            setting = "direct" if episode % 2 else "explicit"
            job = Job(policy="p", task="StopCube", split="test", episode=episode, setting=setting)
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
        job = Job(policy="other", task="StopCube", split="test", episode=0, setting="explicit")
        store.append(make_record(job, RolloutResult(), started_at=""))
    with pytest.raises(InvalidValueError, match="no episode in common"):
        repeated_episodes(one, two)
