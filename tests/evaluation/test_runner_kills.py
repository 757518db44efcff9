"""SIGKILL at random moments, again and again, and the same command after each of them."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import evaluation_fakes
import pytest
from evaluation_fakes import FakePlay, comparable, is_alive, small_plan, worker_pids

from roboirg.evaluation.records.line_file import LineFile
from roboirg.evaluation.records.record_codec import read_record
from roboirg.evaluation.records.store import RECORDS_FILE, read_records
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan

KILLS = int(os.environ.get("ROBOIRG_TEST_KILLS", "6"))
EPISODES, SEEDS = 14, max(1, KILLS // 6)
"""Two records each; more than the kills let through, so that the run is always being killed."""


@pytest.mark.slow
def test_after_any_number_of_sigkills_the_records_are_those_of_an_undisturbed_run(
    tmp_path: Path,
) -> None:
    folder, undisturbed = tmp_path / "killed", tmp_path / "undisturbed"
    folder.mkdir()
    plan = small_plan(EPISODES, seeds=SEEDS)
    run_plan(plan, undisturbed, FakePlay(), InProcess())
    command = [
        sys.executable,
        evaluation_fakes.__file__,
        str(folder),
        str(EPISODES),
        str(SEEDS),
        "0.2",
    ]
    rng, seen, late = random.Random(0), 0, 0
    for _ in range(KILLS):
        child = subprocess.Popen(command)
        # From before anything is imported to the middle of episodes.
        time.sleep(rng.uniform(0.05, 2.5))
        late += child.poll() is not None
        child.send_signal(signal.SIGKILL)
        child.wait()
        lines = LineFile(folder / RECORDS_FILE)
        records = list(lines.parse(read_record))
        # Nothing that was there is lost, nothing is doubled.
        assert len(records) >= seen
        assert len({record.identity for record in records}) == len(records)
        assert not lines.damaged
        seen = len(records)
    assert subprocess.run(command, check=False).returncode == 0
    assert not any(map(is_alive, worker_pids(folder)))
    killed = {record.slug: comparable(record) for record in read_records(folder)}
    assert killed == {record.slug: comparable(record) for record in read_records(undisturbed)}
    lines = LineFile(folder / RECORDS_FILE)
    assert list(lines.parse(read_record))
    assert lines.torn == b""
    assert late < KILLS  # a busy machine may let a run finish between two of them
