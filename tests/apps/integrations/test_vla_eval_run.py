"""The benchmark class in the real vla-eval: `make integrations` runs this in its environment."""

import contextlib
import json
import os
import socket
import sqlite3
import subprocess
import sys
import time
from typing import NamedTuple

import pytest

pytest.importorskip("vla_eval", reason="vla-eval is not installed here; run `make integrations`")

import yaml
from page_commands import HERE, ROOT, check_versions, run_page
from replay_table import (
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


class VLAEvalRun(NamedTuple):
    """What a command of vla-eval left.

    Attributes:
        outcomes: (task, episode, whether it succeeded, steps) of each episode.
        told: (kind, content) of all that the server of the policy was told, in order.
    """

    outcomes: list
    told: list


@pytest.fixture(scope="module", params=BATCHES)
def vla_eval_run(table, request, tmp_path_factory):
    """The page's command, played by vla-eval with a server of recorded actions.

    The configuration is replaced by one with fewer episodes, and the one shard by as many as play
    at a time.
    """
    folder = tmp_path_factory.mktemp("vla-eval")
    log = folder / "told.jsonl"
    with serving(table, log, request.param) as port:
        write_configuration(folder / "run.yaml", port)
        values = {"integrations/vla_eval/roboirg.yaml": "run.yaml", **in_shards(request.param)}
        run_page("vla-eval", folder, values)
    recording = folder / "runs" / "vla-eval" / "recording-first.sqlite"
    with contextlib.closing(sqlite3.connect(recording)) as database:
        rows = database.execute(
            "SELECT task_name, context, status, steps FROM episode_results"
        ).fetchall()
    outcomes = [
        (task, json.loads(context)["episode_idx"], status == "success", steps)
        for task, context, status, steps in rows
    ]
    return VLAEvalRun(outcomes, [json.loads(line) for line in log.read_text().splitlines()])


def test_vla_eval_and_our_runner_agree_on_success_and_steps_of_each_episode(vla_eval_run, ours):
    """`vla_eval_run` is of the documented command with a policy of recorded actions, some of them
    cut short; `ours` are outcomes of our runner with the same actions in the same episodes.
    """
    assert sorted(vla_eval_run.outcomes) == sorted(ours)


def test_an_episode_of_vla_eval_starts_with_the_name_of_the_benchmark_alone(vla_eval_run):
    """vla-eval sends the task to the policy when an episode starts; the name of ours would tell
    what is to be done."""
    starts = [content for kind, content in vla_eval_run.told if kind == "start"]

    assert len(starts) == len(vla_eval_run.outcomes)
    assert all(start["task"] == {"name": "RoboIRGBench"} for start in starts)


@pytest.mark.parametrize("secret", [SETTING, *PLAYED, "goal", "seed", "episode_idx"])
def test_what_vla_eval_tells_a_policy_does_not_give_the_goal_away(vla_eval_run, secret):
    """Starts and ends of episodes name neither the setting, the task nor the episode.

    Of observations, the names of their fields are checked by a test of their own.
    """
    messages = [content for kind, content in vla_eval_run.told if kind != "observation"]

    assert messages
    assert secret not in json.dumps(messages)


def test_observations_of_vla_eval_have_the_documented_fields_and_the_first_one_the_videos(
    vla_eval_run,
):
    """The server wrote down the sorted names of the fields of each observation.

    Where many episodes are played, the configuration sends no videos (`SENDS_ALL` is false), and no
    observation has the fields of a first one.
    """
    later = ["images", "states", "task_description"]
    first = ["episode_restart", *later, "video_history", "wrist_video_history"]

    shown = [content for kind, content in vla_eval_run.told if kind == "observation"]

    assert later in shown
    assert (first in shown) == SENDS_ALL
    assert all(fields in (first, later) for fields in shown)


def test_the_page_names_the_version_that_is_played():
    check_versions("vla-eval")


def test_the_class_declares_what_it_does():
    """The benchmark has 11 tasks of 50 episodes, of at most 1,300 steps; a pose has 7 numbers.

    Without wrist pictures, observations are the front picture, the words and the state.
    """
    benchmark = RoboIRGBenchmark(send_wrist_image=False, action_space="ee_pose")
    assert len(benchmark.get_tasks()) == 11
    assert benchmark.get_metadata() == {"max_steps": 1300, "max_episodes_per_task": 50}
    assert set(benchmark.get_observation_spec()) == {"agentview", "language", "state"}
    assert benchmark.get_action_spec()["action"].dims == 7
