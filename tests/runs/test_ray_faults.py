"""One bad machine of a Ray cluster costs no record, and is named once."""

import os
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path
from unittest import mock

import pytest
import ray_fakes
from ray_fakes import BAD_MACHINE, NotingPlace, WithoutModule, WithoutVulkan
from run_fakes import FakePlayer, changed, line_count, small_plan

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.records.store import RECORDS_FILE, read_records
from roboirg.runs.plan.plan_sections import WorkerNeeds
from roboirg.runs.run import ray_head, ray_pool
from roboirg.runs.run.progress import Reporter
from roboirg.runs.run.ray_cluster import RayCluster
from roboirg.runs.run.runner import run_plan

pytestmark = pytest.mark.slow

ray = pytest.importorskip("ray")

PLAN_OF_16_EPISODES = changed(small_plan(8), tries=3)


@pytest.fixture
def cluster(monkeypatch):
    from ray.cluster_utils import Cluster

    monkeypatch.syspath_prepend(Path(ray_fakes.__file__).parent)
    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield nodes
    ray.shutdown()
    nodes.shutdown()


def process_ids_of_actors(cluster, name):
    """Return the processes of this cluster's actors, as other tests may have clusters, too."""
    raylets = [node.all_processes["raylet"][0].process.pid for node in cluster.list_all_nodes()]
    command = ["pgrep", "-P", ",".join(map(str, raylets)), "-f", f"ray::{name}"]
    found = subprocess.run(command, capture_output=True, check=False)
    return list(map(int, found.stdout.split()))


def act_after_records(folder, count, act, run_ended=None):
    """Act in a thread as soon as that many records are stored; never, if the run ends before."""

    def run():
        while line_count(folder) < count:
            if run_ended is not None and run_ended():
                return
            time.sleep(0.05)
        act()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize(
    ("play", "policy", "fault"),
    [
        (WithoutVulkan, "random", "No Vulkan device can render; install one"),
        (WithoutModule, "random", "No module named 'needed_here'"),
        (FakePlayer, "local_policy:Local", "No module named 'their_model'"),
    ],
)
def test_a_machine_that_cannot_play_is_left_out_and_named_once_and_the_others_play_all(
    cluster, tmp_path, play, policy, fault
):
    """The last episode waits for a gate, which opens when the machine has been left out."""
    cluster.add_node(num_cpus=1, env_vars={BAD_MACHINE: "1"})
    gate = tmp_path / "gate"
    reporter = mock.Mock(spec=Reporter)
    reporter.warn.side_effect = lambda text: "left out" in text and gate.touch()
    plan = changed(small_plan(8, (policy,)), tries=3)
    player = play(tmp_path, gate=gate, closed=7)

    executor = RayCluster(address=cluster.address)
    summary = run_plan(plan, tmp_path, player, executor, reporter=reporter)

    assert (summary.errors, summary.missing) == ((), 0)
    assert line_count(tmp_path) == len(plan.jobs())  # nothing that it played was stored
    warnings = [call.args[0] for call in reporter.warn.call_args_list]
    (warning,) = [text for text in warnings if "left out" in text]
    assert fault in warning


@pytest.mark.parametrize("actor", ["RemoteWorker", "MachineAgent"])
def test_a_worker_or_machine_that_freezes_is_ended_and_its_episode_played_elsewhere(
    cluster, tmp_path, monkeypatch, actor
):
    """It is stopped after four episodes; the last one waits until its process has been ended."""
    monkeypatch.setattr(ray_pool, "BEAT_S", 1.0)
    monkeypatch.setattr(ray_pool, "SILENCE_S", 300.0)
    cluster.add_node(num_cpus=1)
    frozen = []

    def freeze():
        frozen.append(process_ids_of_actors(cluster, actor)[0])
        # Not before: Ray may take longer to start an actor.
        monkeypatch.setattr(ray_pool, "SILENCE_S", 20.0)
        os.kill(frozen[0], signal.SIGSTOP)

    play = FakePlayer(tmp_path, 0.5, gate=tmp_path / "gate", closed=7)
    executor = RayCluster(address=cluster.address)
    run = threading.Thread(target=run_plan, args=(PLAN_OF_16_EPISODES, tmp_path, play, executor))
    run.start()
    act_after_records(tmp_path, 4, freeze, lambda: not run.is_alive()).join()
    deadline = time.monotonic() + 300
    while frozen and Path(f"/proc/{frozen[0]}").exists() and run.is_alive():
        if time.monotonic() > deadline:
            break
        time.sleep(0.1)
    (tmp_path / "gate").touch()
    run.join()

    assert frozen, "the run ended before anything was frozen"
    assert not Path(f"/proc/{frozen[0]}").exists()
    records = read_records(tmp_path)
    assert len(records) == len(PLAN_OF_16_EPISODES.jobs())
    assert {record.error for record in records} == {None}
    assert "has not answered" in (tmp_path / RECORDS_FILE).read_text()


def test_a_run_waits_for_a_free_machine_and_uses_one_that_joins_later(tmp_path, monkeypatch):
    """A cluster starts without a CPU; after the first warning a machine with one joins it.

    Warnings come after two seconds here. In the end all 16 episodes are stored.
    """
    from ray.cluster_utils import Cluster

    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    reporter = mock.Mock(spec=Reporter)
    monkeypatch.setattr(ray_pool, "WAIT_S", 2.0)
    run = threading.Thread(
        target=run_plan,
        args=(
            PLAN_OF_16_EPISODES,
            tmp_path,
            FakePlayer(tmp_path),
            RayCluster(address=nodes.address),
        ),
        kwargs={"reporter": reporter},
    )
    try:
        run.start()
        while not reporter.warn.called and run.is_alive():
            time.sleep(0.1)
        nodes.add_node(num_cpus=1)
        run.join()
    finally:
        ray.shutdown()
        nodes.shutdown()

    assert "Waiting for a free CPU" in reporter.warn.call_args_list[0].args[0]
    assert line_count(tmp_path) == len(PLAN_OF_16_EPISODES.jobs())


def test_a_worker_gets_the_label_gpu_share_variables_and_folder_that_the_plan_asks_for(
    cluster, tmp_path, monkeypatch
):
    """Each notes its variable A_KEY, a file of the copied folder and the label of its machine."""
    folder = tmp_path / "policies"
    folder.mkdir()
    (folder / "note.txt").write_text("copied")
    here = Path(ray_fakes.__file__).parent
    for module in ("ray_fakes.py", "run_fakes.py", "made_records.py"):
        shutil.copy(here / module, folder)
    for rack in ("a", "b"):
        cluster.add_node(num_cpus=2, num_gpus=1, labels={"rack": rack}, env_vars={"RACK": rack})
    monkeypatch.setenv("A_KEY", "secret")
    needs = WorkerNeeds(
        gpus=0.5, labels={"rack": "b"}, variables=("A_KEY",), working_dir=str(folder)
    )
    out = tmp_path / "run"

    executor = RayCluster(address=cluster.address, needs=needs)
    run_plan(PLAN_OF_16_EPISODES, out, NotingPlace(out), executor)

    notes = {(out / str(record.video)).read_text() for record in read_records(out)}
    assert notes == {"secret copied b"}


def test_a_variable_for_workers_that_is_not_set_here_is_refused(cluster, tmp_path):
    needs = WorkerNeeds(variables=("NOT_SET_HERE",))
    executor = RayCluster(address=cluster.address, needs=needs)

    with pytest.raises(InvalidValueError, match="NOT_SET_HERE is not set here"):
        run_plan(small_plan(1), tmp_path, FakePlayer(tmp_path), executor)


def test_a_run_that_loses_the_head_of_its_cluster_ends_in_one_sentence_and_keeps_its_records(
    cluster, tmp_path, monkeypatch
):
    """After four records the process that controls the cluster is killed; later episodes wait.

    The run notices within 5 seconds here and says that the same command goes on. Each line of the
    file is a record that can be read, at least the four.
    """
    monkeypatch.setattr(ray_head, "HEAD_LOST_S", 5.0)
    gcs = cluster.head_node.all_processes["gcs_server"][0].process.pid

    def kill():
        # A call under way for the machines would wait until Ray ends this process.
        monkeypatch.setattr(ray_pool, "LOOK_S", 3600.0)
        # The one that is under way has ended when two more episodes are stored.
        deadline = time.monotonic() + 60
        known = line_count(tmp_path)
        while line_count(tmp_path) < known + 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        os.kill(gcs, signal.SIGKILL)

    act_after_records(tmp_path, 4, kill)
    play = FakePlayer(tmp_path, 0.5, gate=tmp_path / "gate", closed=4)

    with pytest.raises(RoboIRGError, match=r"head of the Ray cluster .* same command again"):
        run_plan(PLAN_OF_16_EPISODES, tmp_path, play, RayCluster(address=cluster.address))
    assert 4 <= line_count(tmp_path) == len(list(read_records(tmp_path)))
