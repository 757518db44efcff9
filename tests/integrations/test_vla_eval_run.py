"""The benchmark class in the real vla-eval: `make integrations` runs this in its environment."""

import contextlib
import json
import os
import socket
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("vla_eval", reason="vla-eval is not installed here; run `make integrations`")

import yaml
from replay_table import MAX_STEPS, MESHES, SETTING, TASK, Replay, record_table

from roboirg.evaluation.rollout import play_episode
from roboirg.integrations.result_import import ImportOptions, import_results
from roboirg.integrations.vla_eval.step_benchmark import RoboIRGBenchmark
from roboirg.records.record import Job
from roboirg.records.store import read_records

pytestmark = pytest.mark.sim

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
EPISODES = int(os.environ.get("ROBOIRG_EQUALITY_EPISODES", "6"))


class ReplayPolicy:
    """The replaying policy for our own runner."""

    cameras = ("front",)
    demonstration_frames = "none"

    def __init__(self, seed=0):
        self.replay, self.rows, self.last = Replay(os.environ["REPLAY_TABLE"]), None, None

    def reset(self, instruction, demonstration):
        self.rows = None

    def act(self, observation):
        if self.rows is None:
            self.rows = self.replay.begin(observation["front_rgb"], observation["instruction"])
        self.last = self.replay.next_row(self.rows, self.last)
        return self.last[None]


@pytest.fixture(scope="session")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "table.npz"
    record_table(path, EPISODES)
    return path


@contextlib.contextmanager
def serving(table, log):
    """Serve the replaying policy; yields its port."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, str(HERE / "replay_server.py"), str(table), str(port), str(log)]
    server = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": f"{ROOT / 'src'}:{HERE}"})
    try:
        while True:
            with contextlib.suppress(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", port)).close()
                break
            assert server.poll() is None
            time.sleep(0.2)
        yield port
    finally:
        server.terminate()
        server.wait()


def test_a_run_has_the_outcomes_of_our_runner_and_tells_nothing(table, tmp_path, monkeypatch):
    monkeypatch.setenv("REPLAY_TABLE", str(table))
    monkeypatch.syspath_prepend(str(HERE))
    ours = [
        play_episode(
            Job(
                policy="test_vla_eval_run:ReplayPolicy", task=TASK, split="test", setting=SETTING,
                episode=episode, max_steps=MAX_STEPS, meshes=MESHES,
            )
        )
        for episode in range(EPISODES)
    ]  # fmt: skip
    assert {one.outcome for one in ours} == {"success", "failure"}, ours
    log, out = tmp_path / "told.jsonl", tmp_path / "results"
    entry = yaml.safe_load((ROOT / "integrations/vla_eval/roboirg.yaml").read_text())
    (first,) = [one for one in entry["benchmarks"] if one["params"]["setting"] == SETTING]
    params = {"setting": SETTING, "tasks": [TASK], "max_steps": MAX_STEPS, "meshes": MESHES}
    entry["benchmarks"] = [{**first, "params": params, "episodes_per_task": EPISODES}]
    with serving(table, log) as port:
        entry |= {"server": {"url": f"ws://127.0.0.1:{port}"}, "output_dir": str(out)}
        (tmp_path / "run.yaml").write_text(yaml.safe_dump(entry))
        done = subprocess.run(
            [
                str(Path(sys.executable).with_name("vla-eval")), "run", "--no-docker",
                "-c", str(tmp_path / "run.yaml"), "--eval-id", "first",
                "--shard-id", "0", "--num-shards", "1",
            ],
            capture_output=True, text=True, check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    with contextlib.closing(sqlite3.connect(out / "recording-first.sqlite")) as database:
        rows = database.execute(
            "SELECT task_name, status, steps FROM episode_results ORDER BY episode_id"
        ).fetchall()
    expected = [
        (TASK, "success" if one.outcome == "success" else "fail", one.steps) for one in ours
    ]
    assert rows == expected
    recording = out / "recording-first.sqlite"
    import_results("vla-eval", recording, tmp_path / "run", ImportOptions("replay"))
    imported = [(one.episode, one.outcome, one.setting) for one in read_records(tmp_path / "run")]
    assert imported == [(index, one.outcome, SETTING) for index, one in enumerate(ours)]
    told = [json.loads(line) for line in log.read_text().splitlines()]
    starts = [content for kind, content in told if kind == "start"]
    assert len(starts) == EPISODES
    assert all(one["task"] == {"name": "RoboIRGBench"} for one in starts)
    words = json.dumps([content for kind, content in told if kind != "observation"])
    for secret in (SETTING, TASK, "goal", "seed", "episode_idx"):
        assert secret not in words
    shown = [content for kind, content in told if kind == "observation"]
    assert shown[0] == [
        "episode_restart", "images", "states", "task_description", "video_history",
        "wrist_video_history",
    ]  # fmt: skip
    assert shown[1] == ["images", "states", "task_description"]


def test_the_class_declares_what_it_does():
    benchmark = RoboIRGBenchmark(send_wrist_image=False, action_space="ee_pose")
    assert len(benchmark.get_tasks()) == 11
    assert benchmark.get_metadata() == {"max_steps": 1300, "max_episodes_per_task": 50}
    assert set(benchmark.get_observation_spec()) == {"agentview", "language", "state"}
    assert benchmark.get_action_spec()["action"].dims == 7
