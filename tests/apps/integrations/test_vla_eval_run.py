"""The benchmark class in the real vla-eval: `make integrations` runs this in its environment."""

import contextlib
import json
import os
import socket
import sqlite3
import subprocess
import sys
import time

import pytest

pytest.importorskip("vla_eval", reason="vla-eval is not installed here; run `make integrations`")

import yaml
from page_commands import HERE, ROOT, check_versions, run_page
from replay_table import (
    EPISODES,
    MANY,
    MAX_STEPS,
    MESHES,
    PER_TASK,
    PLAYED,
    SETTING,
)

from roboirg.apps.integrations.vla_eval.step_benchmark import RoboIRGBenchmark

pytestmark = pytest.mark.sim

BATCHES = [1, 2, 8] if MANY else [1]
SENDS_ALL = not MANY
"""Whether the policy gets videos and wrist pictures, which take most of the time."""
SHARD = "--shard-id 0 --num-shards 1"


@contextlib.contextmanager
def serving(table, log, batch):
    """Serve the replaying policy in batches; yields its port."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [
        sys.executable, str(HERE / "replay_server.py"), str(table), str(port), str(log), str(batch),
    ]  # fmt: skip
    server = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(HERE)})
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


def write_configuration(path, port):
    """Write our configuration with one of its entries and fewer episodes."""
    content = yaml.safe_load((ROOT / "integrations/vla_eval/roboirg.yaml").read_text())
    (entry,) = [
        benchmark
        for benchmark in content["benchmarks"]
        if benchmark["params"]["setting"] == SETTING
    ]
    entry["params"] |= {"tasks": list(PLAYED), "max_steps": MAX_STEPS, "meshes": MESHES}
    if not SENDS_ALL:
        entry["params"] |= {"send_wrist_image": False, "send_video_history": False}
    entry["episodes_per_task"] = PER_TASK
    content |= {"server": {"url": f"ws://127.0.0.1:{port}"}, "benchmarks": [entry]}
    path.write_text(yaml.safe_dump(content))


def in_shards(count):
    """Return what to say on the page instead of one shard: as many at a time."""
    if count == 1:
        return {}
    shell = "& shards+=($!); done; for shard in ${shards[@]}; do wait $shard; done"
    return {
        "vla-eval run --": f"for i in $(seq 0 {count - 1}); do vla-eval run --",
        SHARD: f"--shard-id $i --num-shards {count} {shell}",
    }


@pytest.mark.parametrize("batch", BATCHES)
def test_the_page_s_commands_have_the_outcomes_of_our_runner(table, ours, tmp_path, batch):
    """The page's commands are played by vla-eval with a server of recorded actions.

    Replaced are the configuration, by one with fewer episodes, and the shards, by as many as play
    at a time. `ours` has outcomes of our runner with the same actions: they agree in success and
    steps. The server was told nothing that gives the goal away.
    """
    log = tmp_path / "told.jsonl"
    with serving(table, log, batch) as port:
        write_configuration(tmp_path / "run.yaml", port)
        values = {"integrations/vla_eval/roboirg.yaml": "run.yaml", **in_shards(batch)}
        run_page("vla-eval", tmp_path, values)
    recording = tmp_path / "runs" / "vla-eval" / "recording-first.sqlite"
    with contextlib.closing(sqlite3.connect(recording)) as database:
        rows = database.execute(
            "SELECT task_name, context, status, steps FROM episode_results"
        ).fetchall()

    found = [
        (task, json.loads(context)["episode_idx"], status == "success", steps)
        for task, context, status, steps in rows
    ]

    assert sorted(found) == sorted(ours)
    check_that_nothing_is_told(log)


def check_that_nothing_is_told(log):
    told = [json.loads(line) for line in log.read_text().splitlines()]

    starts = [content for kind, content in told if kind == "start"]
    assert len(starts) == EPISODES
    assert all(start["task"] == {"name": "RoboIRGBench"} for start in starts)

    words = json.dumps([content for kind, content in told if kind != "observation"])
    for secret in (SETTING, *PLAYED, "goal", "seed", "episode_idx"):
        assert secret not in words

    later = ["images", "states", "task_description"]
    first = ["episode_restart", *later, "video_history", "wrist_video_history"]
    shown = [content for kind, content in told if kind == "observation"]
    assert (first in shown) == SENDS_ALL
    assert all(fields in (first, later) for fields in shown)


def test_the_page_names_the_version_that_is_played():
    check_versions("vla-eval")


def test_the_class_declares_what_it_does():
    """11 tasks of the benchmark, 1,300 steps and 50 episodes; a pose has 7 numbers.

    Without wrist pictures, observations are the front picture, the words and the state.
    """
    benchmark = RoboIRGBenchmark(send_wrist_image=False, action_space="ee_pose")
    assert len(benchmark.get_tasks()) == 11
    assert benchmark.get_metadata() == {"max_steps": 1300, "max_episodes_per_task": 50}
    assert set(benchmark.get_observation_spec()) == {"agentview", "language", "state"}
    assert benchmark.get_action_spec()["action"].dims == 7
