"""A real Ray cluster of several nodes on this machine."""

from __future__ import annotations

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
from roboirg.runs.run.executor import InProcess, LocalProcesses
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
    doomed = cluster.add_node(num_cpus=1)
    cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)
    killed = threading.Event()

    def kill():
        # Until each of the three machines has one of the endless episodes in hand.
        while line_count(tmp_path) < 8 or len(players := worker_pids(tmp_path, "waiting")) < 3:
            time.sleep(0.05)
        cluster.remove_node(doomed, allow_graceful=False)
        while all(map(is_alive, players)):  # they outlive their node for a moment
            time.sleep(0.05)
        (tmp_path / "gate").touch()
        killed.set()

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    summary = run_plan(
        changed(PLAN_OF_TWO_ARMS, tries=3),
        tmp_path,
        FakePlayer(tmp_path, gate=tmp_path / "gate", closed=2),
        RayCluster(),
    )
    killer.join(300)
    assert killed.is_set()
    assert (summary.errors, summary.missing) == ((), 0)
    # The episode that it had in hand was tried again.
    assert line_count(tmp_path) > len(records_of_one_process)
    assert all_comparable(tmp_path) == records_of_one_process
    for record in read_records(tmp_path):
        assert (tmp_path / str(record.video)).read_text() == record.slug

    # What would end every episode ends the run if all machines say so.
    with pytest.raises(RoboIRGError, match=r"No machine of the Ray cluster.*No Vulkan device"):
        run_plan(PLAN_OF_TWO_ARMS, tmp_path / "b", FakePlayer(tmp_path, fatal=0), RayCluster(1))


def test_all_workers_of_a_machine_ask_one_process_for_their_policy(cluster, tmp_path, monkeypatch):
    """Three workers on two machines, two processes with the policy, which all end with the run."""
    monkeypatch.syspath_prepend(Path(hosting_fakes.__file__).parent)
    plan = fake_world_plan("Resident", 12)
    local = tmp_path / "local"
    far = tmp_path / "far"
    for folder in (local, far):
        folder.mkdir()
    run_plan(plan, local, fake_world_runner(plan, local), LocalProcesses(2))
    cluster.add_node(num_cpus=2)
    ray.init(address=cluster.address, log_to_driver=False)
    run_plan(
        plan,
        far,
        PatientRunner(far, hosting=plan.hosting.settings, notes=far, wanted=3),
        RayCluster(),
    )

    assert [record | {"usage": None} for record in all_comparable(far)] == [
        record | {"usage": None} for record in all_comparable(local)
    ]
    assert len(worker_pids(far)) == 3
    hosts = {int(record.usage["process"]) for record in read_records(far)}
    assert len(hosts) == 2  # one on each of the two machines
    for _ in range(600):
        if not any(map(is_alive, hosts)):
            return
        time.sleep(0.1)
    pytest.fail("a policy's process is left")


def test_a_cluster_that_cannot_be_joined_is_reported_in_one_sentence(tmp_path):
    with pytest.raises(RoboIRGError, match=r"cluster '127\.0\.0\.1:1' cannot be joined") as caught:
        run_plan(
            PLAN_OF_TWO_ARMS, tmp_path, FakePlayer(tmp_path), RayCluster(address="127.0.0.1:1")
        )
    assert "\n" not in str(caught.value)


def test_a_cluster_with_no_worker_is_refused():
    with pytest.raises(InvalidValueError, match="workers is 0"):
        RayCluster(0)


def test_a_silent_client_keeps_no_other_from_the_policy_processes_of_a_machine(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(ray_machines, "KEY_S", 3600.0)
    hosts = MachineAgent(tmp_path / "agent", HostSettings())
    address = hosts.check(MachineVersions(())).hosts

    try:
        with socket.socket(socket.AF_UNIX) as silent:
            silent.connect(address.path)
            with address.connect() as line:
                HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0).close()
    finally:
        hosts.close()


@pytest.mark.parametrize(
    ("name", "owner", "ended"),
    [("{}.pid", 0, True), ("{}.pid", 1, False), ("-{}.pid", 0, False)],
)
def test_an_agent_ends_only_processes_that_its_own_user_has_noted(
    tmp_path, monkeypatch, name, owner, ended
):
    """``-1.pid`` would stand for all processes of the user."""
    folder = tmp_path / "agent"
    folder.mkdir()
    (folder / name.format(123456)).touch()
    killed = []
    monkeypatch.setattr(ray_machines.os, "kill", lambda pid, _signal: killed.append(pid))
    user = folder.lstat().st_uid + owner
    monkeypatch.setattr(ray_machines.os, "getuid", lambda: user)

    MachineAgent(folder, None)

    assert killed == ([123456] if ended else [])


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
