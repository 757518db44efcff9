"""A real Ray cluster of several nodes on this machine."""

import socket
import threading
import time
from pathlib import Path

import hosting_fakes
import pytest
from hosting_fakes import PatientRunner, fake_world_plan, fake_world_runner
from run_fakes import (
    FakePlayer,
    all_comparable,
    changed,
    is_alive,
    line_count,
    small_plan,
    worker_pids,
)

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.store import read_records
from roboirg.runs.hosting.host_pool import HostSettings
from roboirg.runs.hosting.hosted_policy import HostedPolicy
from roboirg.runs.run import ray_machines
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.ray_cluster import RayCluster
from roboirg.runs.run.ray_machines import MachineAgent, MachineVersions
from roboirg.runs.run.runner import run_plan

pytestmark = pytest.mark.slow

ray = pytest.importorskip("ray")

PLAN_OF_TWO_ARMS = small_plan(5).model_copy(update={"arms": ("told", "silent")})


@pytest.fixture(scope="module")
def records_of_one_process(tmp_path_factory):
    folder = tmp_path_factory.mktemp("here")
    run_plan(PLAN_OF_TWO_ARMS, folder, FakePlayer(folder), InProcess())
    return all_comparable(folder)


@pytest.fixture
def cluster():
    from ray.cluster_utils import Cluster

    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield nodes
    ray.shutdown()
    nodes.shutdown()


def test_a_cluster_that_loses_a_machine_half_way_gives_the_same_records_as_one_process(
    cluster, tmp_path, records_of_one_process
):
    """Of three machines one is taken away while each has an episode in hand.

    The episodes from number 2 on wait for a gate, the file `gate`, which opens after the loss. The
    lost episode is tried again (three tries are allowed), so there are more lines than records; the
    records equal those of a run in one process.
    """
    doomed = cluster.add_node(num_cpus=1)
    cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)

    def lose_a_machine():
        # Until each of the three machines has one of the waiting episodes in hand.
        while line_count(tmp_path) < 8 or len(players := worker_pids(tmp_path, "waiting")) < 3:
            time.sleep(0.05)
        cluster.remove_node(doomed, allow_graceful=False)
        while all(map(is_alive, players)):  # they outlive their node for a moment
            time.sleep(0.05)
        (tmp_path / "gate").touch()

    killer = threading.Thread(target=lose_a_machine, daemon=True)
    killer.start()
    plan = changed(PLAN_OF_TWO_ARMS, tries=3)
    player = FakePlayer(tmp_path, gate=tmp_path / "gate", closed=2)
    summary = run_plan(plan, tmp_path, player, RayCluster())
    killer.join(300)

    assert (summary.errors, summary.missing) == ((), 0)
    # The episode that it had in hand was tried again.
    assert line_count(tmp_path) > len(records_of_one_process)
    assert all_comparable(tmp_path) == records_of_one_process
    for record in read_records(tmp_path):
        assert (tmp_path / str(record.video)).read_text() == record.slug


def test_a_run_ends_if_no_machine_of_the_cluster_can_render(cluster, tmp_path):
    ray.init(address=cluster.address, log_to_driver=False)

    with pytest.raises(RoboIRGError, match=r"No machine of the Ray cluster.*No Vulkan device"):
        run_plan(PLAN_OF_TWO_ARMS, tmp_path, FakePlayer(tmp_path, fatal=0), RayCluster(1))


def without_usage(folder):
    """Return the comparable fields of a run's records, but for their usage."""
    return [record | {"usage": None} for record in all_comparable(folder)]


def test_all_workers_of_a_machine_ask_one_process_for_their_policy(cluster, tmp_path, monkeypatch):
    """Three workers on two machines, two processes with the policy, which all end with the run.

    The policy tells its process as its usage; all else in its records is as on one machine.
    """
    monkeypatch.syspath_prepend(Path(hosting_fakes.__file__).parent)
    plan = fake_world_plan("Resident", 12)
    local = tmp_path / "local"
    far = tmp_path / "far"
    local.mkdir()
    far.mkdir()
    cluster.add_node(num_cpus=2)
    ray.init(address=cluster.address, log_to_driver=False)

    run_plan(plan, local, fake_world_runner(plan, local), InProcess())
    runner = PatientRunner(far, hosting=plan.hosting.settings, notes=far, wanted=3)
    run_plan(plan, far, runner, RayCluster())

    assert without_usage(far) == without_usage(local)
    hosts = {int(record.usage["process"]) for record in read_records(far)}
    assert len(worker_pids(far)) == 3
    assert len(hosts) == 2
    for _ in range(600):
        if not any(map(is_alive, hosts)):
            return
        time.sleep(0.1)
    pytest.fail("a policy's process is left")


def test_a_cluster_that_cannot_be_joined_is_reported_in_one_sentence(tmp_path):
    executor = RayCluster(address="127.0.0.1:1")

    with pytest.raises(RoboIRGError, match=r"cluster '127\.0\.0\.1:1' cannot be joined") as caught:
        run_plan(PLAN_OF_TWO_ARMS, tmp_path, FakePlayer(tmp_path), executor)

    assert "\n" not in str(caught.value)


def test_a_cluster_with_no_worker_is_refused():
    with pytest.raises(InvalidValueError, match="workers is 0"):
        RayCluster(0)


@pytest.mark.parametrize(
    ("file", "is_own", "killed"),
    [("123456.pid", True, [123456]), ("123456.pid", False, []), ("-1.pid", True, [])],
)
def test_an_agent_ends_only_processes_that_its_own_user_has_noted(
    tmp_path, monkeypatch, file, is_own, killed
):
    """``-1`` would stand for all processes of the user."""
    folder = tmp_path / "agent"
    folder.mkdir()
    (folder / file).touch()
    owner = folder.lstat().st_uid
    ended = []
    monkeypatch.setattr(ray_machines.os, "kill", lambda pid, _signal: ended.append(pid))
    monkeypatch.setattr(ray_machines.os, "getuid", lambda: owner if is_own else owner + 1)

    MachineAgent(folder, None)

    assert ended == killed


def test_only_a_client_with_the_key_reaches_the_policy_processes_of_a_machine(tmp_path):
    """Another key and a silent client get nothing: their connection is closed."""
    hosts = MachineAgent(tmp_path / "agent", HostSettings())
    address = hosts.check(MachineVersions(())).hosts

    try:
        with address._replace(key=b"x" * 32).connect() as stranger:
            assert stranger.recv(1) == b""
        with socket.socket(socket.AF_UNIX) as idle:
            idle.connect(address.path)
            assert idle.recv(1) == b""
        with address.connect() as line:
            HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0).close()
    finally:
        hosts.close()

    assert not Path(address.path).exists()
