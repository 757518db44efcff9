"""Runs of all tasks, executors and numbers of workers hold; forged at random, none does.

``ROBOIRG_TEST_FORGERIES=100`` forges 100 runs and plays 20 honest ones; the usual tests fewer.
"""

from __future__ import annotations

import functools
import itertools
import json
import os
import random
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from forgeries import FORGERIES, forge

from roboirg.apps.leaderboard.record_check import LineToCheck, ReplayVerdict, check_line
from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.records.store import RECORDS_FILE, read_records
from roboirg.evaluation.run.executor import Executor, InProcess, LocalProcesses
from roboirg.evaluation.run.ray_cluster import RayCluster
from roboirg.evaluation.run.runner import run_plan
from roboirg.tasks import ALL, find_tasks

pytestmark = pytest.mark.sim

FORGED = int(os.environ.get("ROBOIRG_TEST_FORGERIES", "4"))
PER_RUN = 5
"""Forgeries of each honest run."""


class Circling:
    """Moves the tool in a circle, in chunks whose length depends on the seed; may raise."""

    actions = "ee_pose"

    def __init__(self, seed: int = 0) -> None:
        self.seed, self.count = seed, 0

    def reset(self, instruction: str, demonstration: object) -> None:
        del instruction, demonstration
        self.count = 0

    def act(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        self.count += 1
        if self.count == 9 and self.seed % 3 == 0:
            raise RuntimeError("dizzy")
        length = 1 + self.seed % 4
        angles = (np.arange(length) + self.count) / 5
        rows = np.tile(np.append(observation["end_effector"], 1.0), (length, 1))
        rows[:, 0] += 0.01 * np.cos(angles)
        rows[:, 1] += 0.01 * np.sin(angles)
        return rows


HERE = f"{__name__}:Circling"
KINDS: tuple[dict[str, Any], ...] = (
    {"policies": ["oracle", "forgetful"], "settings": "explicit"},
    {"policies": ["listener"], "settings": "direct", "delivery": "turns"},
    {"policies": [f"circling={HERE}"], "settings": "explicit", "policy_seeds": "0-2"},
    {"policies": [HERE, "random"], "settings": "explicit", "policy_process": "shared"},
    {"policies": ["forgetful"], "settings": "direct", "forms": "implicit,resolved"},
)
EXECUTORS = ("in this process", "1 worker", "2 workers", "3 workers", "Ray")


class Honest(NamedTuple):
    """An honest run: how it is played, and where."""

    number: int
    kind: dict[str, Any]
    executor: str
    tasks: str


@functools.cache
def honest_runs() -> tuple[Honest, ...]:
    """Return runs that cover all tasks, and all kinds and executors if there are enough."""
    tasks, count = itertools.cycle(find_tasks([ALL])), max(2, FORGED // PER_RUN)
    return tuple(
        Honest(
            number,
            KINDS[number % len(KINDS)],
            EXECUTORS[(number + number // len(KINDS)) % len(EXECUTORS)],
            ",".join(itertools.islice(tasks, 2)),
        )
        for number in range(count)
    )


def executor_of(name: str) -> Executor:
    if name == "Ray":
        pytest.importorskip("ray")
        return RayCluster(2)
    return LocalProcesses(int(name[0])) if name[0].isdigit() else InProcess()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("honest")


def play(one: Honest, folder: Path) -> Path:
    """Return the folder of an honest run, which is played once."""
    out = folder / str(one.number)
    if out.exists():
        return out
    options = {"max_steps": 300, "episodes": "2", "tasks": one.tasks, **one.kind}
    plan = make_plan(options.pop("policies"), **options)
    runner = EpisodeRunner(out, plan=plan.fingerprint, hosting=plan.hosting)
    run_plan(plan, out, runner, executor_of(one.executor))
    return out


@pytest.mark.parametrize("one", honest_runs(), ids=lambda one: f"{one.number}, {one.executor}")
def test_honest_runs_hold(one: Honest, folder: Path) -> None:
    run = play(one, folder)
    found = verify_run(run, workers=one.number % 3)
    assert found.holds, found
    assert found.records >= 4
    assert found.verdicts[ReplayVerdict.EXACT] == found.records
    assert not found.notes


def is_caught(forged: Path, honest: Path) -> bool:
    """Return whether a forged run does not hold; what is quick to check comes first."""
    if not verify_run(forged, sample=0.0).holds:
        return True
    before = {json.dumps(json.loads(line)) for line in read_lines(honest)}
    for number, line in enumerate(read_lines(forged), start=1):
        changed = json.dumps(json.loads(line)) not in before
        if changed and findings_of(number, line, forged):
            return True  # so the run does not hold, either
    return not verify_run(forged).holds


def findings_of(number: int, line: bytes, run: Path) -> tuple[str, ...]:
    return check_line(LineToCheck(number, line, play=True), run).findings


def read_lines(run: Path) -> list[bytes]:
    return (run / RECORDS_FILE).read_bytes().splitlines()


@pytest.mark.parametrize("number", range(FORGED))
def test_forged_runs_do_not(number: int, folder: Path, tmp_path: Path) -> None:
    rng = random.Random(number)
    # Each kind in turn, of a run at random: some do not apply to every run.
    name = sorted(FORGERIES)[number % len(FORGERIES)]
    for one in rng.sample(honest_runs(), len(honest_runs())):
        run = play(one, folder)
        # Errors are in no rate: what is wrong with them embellishes nothing.
        if any(record.outcome == "error" for record in read_records(run)):
            continue
        forged = tmp_path / str(one.number)
        shutil.copytree(run, forged)
        if forge(forged, FORGERIES[name], rng):
            break
    else:
        pytest.skip(f"no run can be forged: {name}")
    assert is_caught(forged, run), (name, one)
