"""A run of two records with actions, videos, logs and a plan, made without a simulator."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from run_fakes import changed, fake_record, small_plan

from roboirg.records.action_log import ActionLog, write_actions
from roboirg.records.episode_log import log_path
from roboirg.records.store import RecordStore
from roboirg.runs.plan.stored_plans import write_plan


@pytest.fixture(scope="session")
def made_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "run"
    plan = changed(small_plan(1, ("random", "oracle")), settings=("direct",))
    with RecordStore(folder) as store:
        for job in plan.jobs():
            log = ActionLog("joint_angle", np.ones((3, 8)), np.zeros(1, np.int32), np.ones(2))
            video = f"videos/{job.slug}.mp4"
            digest = write_actions(log, folder)
            record = fake_record(
                job,
                started_at="2026-11-23T12:00:00+00:00",
                video=video,
                plan=plan.fingerprint,
                action_log=digest,
            )
            store.append(record)
            for name, content in ((video, b"film"), (log_path(Path(), job.slug), b"printed")):
                (folder / name).parent.mkdir(exist_ok=True)
                (folder / name).write_bytes(content)
            (folder / video).with_suffix(".jpg").write_bytes(b"poster")
    write_plan(plan, folder)
    return folder


@pytest.fixture
def run(made_run, tmp_path):
    """A copy of the run, next to a file that no reader should touch."""
    (tmp_path / "secret.txt").write_text("of another folder")
    return Path(shutil.copytree(made_run, tmp_path / "run"))
