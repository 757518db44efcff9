"""One bad machine of a Ray cluster costs no record, and is named once."""

import os
import shutil
import signal
import subprocess
from pathlib import Path
from unittest import mock

import pytest
import ray_fakes
from ray_fakes import NotingPlace, WithoutModule, WithoutVulkan, start_run, wait_until
from run_fakes import FakePlayer, changed, is_alive, line_count, small_plan

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
"""Numbers 0 to 7, each in two settings; an episode that ends in an error is played thrice."""


def started_cluster(cpus):
    from ray.cluster_utils import Cluster

    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": cpus})
    yield nodes
    ray.shutdown()
    nodes.shutdown()


@pytest.fixture
def cluster_without_cpu():
    yield from started_cluster(cpus=0)


@pytest.fixture
def cluster_with_one_cpu(monkeypatch):
    monkeypatch.syspath_prepend(Path(ray_fakes.__file__).parent)
    yield from started_cluster(cpus=1)


def process_ids_of_actors(cluster, name):
    """Return the processes of this cluster's actors, as other tests may have clusters, too."""
    raylets = [node.all_processes["raylet"][0].process.pid for node in cluster.list_all_nodes()]
    command = ["pgrep", "-P", ",".join(map(str, raylets)), "-f", f"ray::{name}"]
    found = subprocess.run(command, capture_output=True, check=False)
    return list(map(int, found.stdout.split()))


def warnings_with(words, reporter):
    """Return the warnings that a replaced reporter got and that have some words."""
    texts = [call.args[0] for call in reporter.warn.call_args_list]
    return [text for text in texts if words in text]


@pytest.mark.parametrize(
    ("play", "policy", "fault"),
    [
        (WithoutVulkan, "random", "No Vulkan device can render; install one"),
        (WithoutModule, "random", "No module named 'needed_here'"),
        (FakePlayer, "local_policy:Local", "No module named 'their_model'"),
    ],
    ids=["no graphics", "its code cannot be loaded", "the policy cannot be loaded"],
)
def test_a_machine_that_cannot_play_is_left_out_and_named_once_and_the_others_play_all(
    cluster_with_one_cpu, tmp_path, play, policy, fault
):
    """Two machines play 16 episodes. On one of them the variable BAD_MACHINE is set, with which an
    error is raised: by what plays, when it is loaded or called, or by the module of the policy.

    Both episodes with number 7 wait for the file `gate`, which is made when the user was warned, so
    that the run lasts as long. One line for each episode is written: the errors cost none.
    """
    cluster_with_one_cpu.add_node(num_cpus=1, env_vars={"BAD_MACHINE": "1"})
    player = play(tmp_path, gate=tmp_path / "gate", closed=7)
    executor = RayCluster(address=cluster_with_one_cpu.address)
    reporter = mock.Mock(spec=Reporter)

    plan = changed(PLAN_OF_16_EPISODES, policies=(policy,))
    run = start_run(plan, tmp_path, player, executor, reporter=reporter)
    wait_until(lambda: warnings_with("left out", reporter), run)
    (tmp_path / "gate").touch()

    assert (run.result().errors, run.result().missing) == ((), 0)
    assert line_count(tmp_path) == 16
    (warning,) = warnings_with("left out", reporter)
    assert fault in warning


@pytest.mark.parametrize("actor", ["RemoteWorker", "MachineAgent"])
def test_a_worker_or_machine_that_freezes_is_ended_and_its_episode_played_elsewhere(
    cluster_with_one_cpu, tmp_path, monkeypatch, actor
):
    """Two machines play 16 episodes. After four of them a process, a worker or what looks after a
    machine, is stopped by a signal: it is alive, but does nothing any more.

    A run asks its processes every second here, and ends one that has not answered for 20 s. (At
    first it has 300 s, as Ray may take long to start.) The episodes with number 7 wait for the file
    `gate`, which is made when the process has ended.
    """
    monkeypatch.setattr(ray_pool, "BEAT_S", 1.0)
    monkeypatch.setattr(ray_pool, "SILENCE_S", 300.0)
    cluster_with_one_cpu.add_node(num_cpus=1)
    player = FakePlayer(tmp_path, seconds=0.5, gate=tmp_path / "gate", closed=7)
    executor = RayCluster(address=cluster_with_one_cpu.address)

    run = start_run(PLAN_OF_16_EPISODES, tmp_path, player, executor)
    wait_until(lambda: line_count(tmp_path) >= 4, run)
    frozen, *_ = process_ids_of_actors(cluster_with_one_cpu, actor)
    monkeypatch.setattr(ray_pool, "SILENCE_S", 20.0)
    os.kill(frozen, signal.SIGSTOP)
    wait_until(lambda: not is_alive(frozen), run)
    (tmp_path / "gate").touch()
    run.result()

    assert not is_alive(frozen)
    assert [record.error for record in read_records(tmp_path)] == [None] * 16
    assert "has not answered" in (tmp_path / RECORDS_FILE).read_text()


def test_a_run_waits_for_a_free_machine_and_uses_one_that_joins_later(
    cluster_without_cpu, tmp_path, monkeypatch
):
    """A cluster has no CPU at first; a machine with one joins it when the user was warned.

    Warnings come after two seconds here. In the end all 16 episodes are stored.
    """
    monkeypatch.setattr(ray_pool, "WAIT_S", 2.0)
    reporter = mock.Mock(spec=Reporter)
    executor = RayCluster(address=cluster_without_cpu.address)

    player = FakePlayer(tmp_path)
    run = start_run(PLAN_OF_16_EPISODES, tmp_path, player, executor, reporter=reporter)
    wait_until(lambda: reporter.warn.called, run)
    cluster_without_cpu.add_node(num_cpus=1)
    run.result()

    assert "Waiting for a free CPU" in reporter.warn.call_args_list[0].args[0]
    assert line_count(tmp_path) == 16


@pytest.fixture
def folder_to_copy(tmp_path):
    """A folder with a file, note.txt, that says "copied", and with the modules of `NotingPlace`."""
    folder = tmp_path / "policies"
    folder.mkdir()
    (folder / "note.txt").write_text("copied")
    for module in ("ray_fakes.py", "run_fakes.py", "made_records.py"):
        shutil.copy(Path(ray_fakes.__file__).with_name(module), folder)
    return folder


def test_a_worker_gets_the_label_gpu_share_variables_and_folder_that_the_plan_asks_for(
    cluster_with_one_cpu, folder_to_copy, tmp_path, monkeypatch
):
    """Of two machines with a GPU, one has the label rack=a and the other rack=b.

    The plan asks for workers with half a GPU at rack b, the variable A_KEY as it is set here, and a
    copy of a folder as their working folder. `NotingPlace` writes for each episode where it was
    played: the value of A_KEY, the content of note.txt, which is in the folder, and the rack.
    """
    for rack in ("a", "b"):
        label = {"rack": rack}
        cluster_with_one_cpu.add_node(num_cpus=2, num_gpus=1, labels=label, env_vars={"RACK": rack})
    monkeypatch.setenv("A_KEY", "secret")
    needs = WorkerNeeds(
        gpus=0.5, labels={"rack": "b"}, variables=("A_KEY",), working_dir=str(folder_to_copy)
    )
    executor = RayCluster(address=cluster_with_one_cpu.address, needs=needs)

    out = tmp_path / "run"
    run_plan(PLAN_OF_16_EPISODES, out, NotingPlace(out), executor)

    notes = [(out / record.video).read_text() for record in read_records(out)]
    assert notes == ["secret copied b"] * 16


def test_a_variable_for_workers_that_is_not_set_here_is_refused(cluster_with_one_cpu, tmp_path):
    """A plan may name variables whose values workers get from the environment of the run."""
    needs = WorkerNeeds(variables=("NOT_SET_HERE",))
    executor = RayCluster(address=cluster_with_one_cpu.address, needs=needs)

    with pytest.raises(InvalidValueError, match="NOT_SET_HERE is not set here"):
        run_plan(small_plan(1), tmp_path, FakePlayer(tmp_path), executor)


def test_a_run_that_loses_the_head_of_its_cluster_ends_in_one_sentence_and_keeps_its_records(
    cluster_with_one_cpu, tmp_path, monkeypatch
):
    """The process that controls a cluster, its head, is killed while an episode is under way.

    Eight episodes, of numbers 0 to 3, were stored before; the others wait for a file that is never
    made. The run notices the loss within 5 seconds here, says that the same command goes on, and
    has eight records that can be read.
    """
    monkeypatch.setattr(ray_head, "HEAD_LOST_S", 5.0)
    player = FakePlayer(tmp_path, seconds=0.5, gate=tmp_path / "never", closed=4)
    executor = RayCluster(address=cluster_with_one_cpu.address)

    run = start_run(PLAN_OF_16_EPISODES, tmp_path, player, executor)
    wait_until(lambda: line_count(tmp_path) >= 4, run)
    # No more questions for the machines: one under way would wait until Ray ends this process.
    monkeypatch.setattr(ray_pool, "LOOK_S", 3600.0)
    wait_until(lambda: line_count(tmp_path) == 8, run)
    os.kill(cluster_with_one_cpu.head_node.all_processes["gcs_server"][0].process.pid, 9)

    with pytest.raises(RoboIRGError, match=r"head of the Ray cluster .* same command again"):
        run.result()
    assert len(read_records(tmp_path)) == line_count(tmp_path) == 8
