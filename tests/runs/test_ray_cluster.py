"""A real Ray cluster of several nodes on this machine."""

import socket
from pathlib import Path

import hosting_fakes
import pytest
from hosting_fakes import PatientRunner, fake_world_plan, fake_world_runner
from ray_fakes import start_run, wait_until
from run_fakes import (
    FakePlayer,
    Lucky,
    all_comparable,
    changed,
    found_in,
    is_alive,
    line_count,
    small_plan,
    two_policies,
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

PLAN_OF_20_EPISODES = small_plan(5).model_copy(update={"arms": ("told", "silent")})


@pytest.fixture(scope="module")
def records_of_one_process(tmp_path_factory):
    folder = tmp_path_factory.mktemp("here")
    run_plan(PLAN_OF_20_EPISODES, folder, FakePlayer(folder), InProcess())
    return all_comparable(folder)


@pytest.fixture
def cluster_with_one_cpu():
    from ray.cluster_utils import Cluster

    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield nodes
    ray.shutdown()
    nodes.shutdown()


def test_a_cluster_that_loses_a_machine_half_way_gives_the_same_records_as_one_process(
    cluster_with_one_cpu, tmp_path, records_of_one_process
):
    """Three machines with a CPU each play 20 episodes: numbers 0 to 4, in two settings and arms.

    The 8 episodes with numbers 0 and 1 end at once. The others wait until the file `gate` is there,
    which is made after one machine was taken away with the episode that it had in hand. That one is
    played again (a plan may try three times), so more lines are written than there are records.
    The video that `FakePlayer` makes of an episode is a file with the name of the episode in it.
    """
    plan = changed(PLAN_OF_20_EPISODES, tries=3)
    player = FakePlayer(tmp_path, gate=tmp_path / "gate", closed=2)
    cluster = cluster_with_one_cpu
    doomed_machine = cluster.add_node(num_cpus=1)
    cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)

    run = start_run(plan, tmp_path, player, RayCluster())
    wait_until(lambda: line_count(tmp_path) == 8, run)
    wait_until(lambda: len(worker_pids(tmp_path, "waiting")) == 3, run)
    workers = worker_pids(tmp_path, "waiting")
    cluster.remove_node(doomed_machine, allow_graceful=False)
    wait_until(lambda: not all(map(is_alive, workers)), run)
    (tmp_path / "gate").touch()

    assert (run.result().errors, run.result().missing) == ((), 0)
    assert line_count(tmp_path) > 20
    assert all_comparable(tmp_path) == records_of_one_process
    for record in read_records(tmp_path):
        assert (tmp_path / record.video).read_text() == record.slug


def test_a_run_on_a_cluster_is_decided_at_the_same_scene_as_in_one_process(
    cluster_with_one_cpu, tmp_path
):
    """Three workers play scenes ahead of the decision, and these count nowhere.

    How many depends on the machine: all, if the worker of the first scene is slow.
    """
    cluster_with_one_cpu.add_node(num_cpus=2)
    ray.init(address=cluster_with_one_cpu.address, log_to_driver=False)
    plan = two_policies()
    alone = run_plan(plan, tmp_path / "alone", Lucky(), InProcess())

    run_plan(plan, tmp_path / "cluster", Lucky(seconds=0.05), RayCluster())

    assert alone.spared > 0
    assert found_in(tmp_path / "cluster", plan) == found_in(tmp_path / "alone", plan)


def test_a_run_ends_if_no_machine_of_the_cluster_can_render(cluster_with_one_cpu, tmp_path):
    """On the only machine episodes with number 0 find no graphics, as without a driver."""
    player = FakePlayer(tmp_path, fatal=0)
    ray.init(address=cluster_with_one_cpu.address, log_to_driver=False)

    with pytest.raises(RoboIRGError, match=r"No machine of the Ray cluster.*No Vulkan device"):
        run_plan(PLAN_OF_20_EPISODES, tmp_path, player, RayCluster(1))


def test_a_users_policy_gets_the_same_records_on_a_cluster_as_in_one_process(
    cluster_with_one_cpu, tmp_path_factory, monkeypatch
):
    """The policy, `Dice`, draws its actions by chance, from the seed of the episode.

    Worlds without a simulator, in which it acts, stand in for the real ones.
    """
    monkeypatch.syspath_prepend(Path(hosting_fakes.__file__).parent)
    ray.init(address=cluster_with_one_cpu.address, log_to_driver=False)
    plan = fake_world_plan("Dice", 4)
    local = tmp_path_factory.mktemp("local")
    remote = tmp_path_factory.mktemp("remote")

    run_plan(plan, local, fake_world_runner(plan, local), InProcess())
    run_plan(plan, remote, fake_world_runner(plan, remote), RayCluster())

    assert len(all_comparable(local)) == 4
    assert all_comparable(remote) == all_comparable(local)


def test_all_workers_of_a_machine_ask_one_process_for_their_policy(
    cluster_with_one_cpu, tmp_path, monkeypatch
):
    """A machine with one CPU and one with two have three workers, but two processes with a policy.

    The policy, `Resident`, reports the id of its process as its usage. `PatientRunner` stands in
    for the simulator; it begins when three workers have come, so that each plays. The processes
    with the policy end with the run: within five minutes, as long as `wait_until` waits.
    """
    monkeypatch.syspath_prepend(Path(hosting_fakes.__file__).parent)
    cluster_with_one_cpu.add_node(num_cpus=2)
    ray.init(address=cluster_with_one_cpu.address, log_to_driver=False)
    plan = fake_world_plan("Resident", 12)
    runner = PatientRunner(tmp_path, hosting=plan.hosting.settings, notes=tmp_path, wanted=3)

    run_plan(plan, tmp_path, runner, RayCluster())

    policy_processes = {int(record.usage["process"]) for record in read_records(tmp_path)}
    assert len(worker_pids(tmp_path)) == 3
    assert len(policy_processes) == 2
    wait_until(lambda: not any(map(is_alive, policy_processes)))


def test_a_cluster_that_cannot_be_joined_is_reported_in_one_sentence(tmp_path):
    """Nothing listens at port 1. What Ray says about it, in many lines, is not shown."""
    executor = RayCluster(address="127.0.0.1:1")

    with pytest.raises(RoboIRGError, match=r"cluster '127\.0\.0\.1:1' cannot be joined") as caught:
        run_plan(PLAN_OF_20_EPISODES, tmp_path, FakePlayer(tmp_path), executor)

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
    """An agent finds the notes of an earlier one, which has crashed: a file named by the id of a
    process that it left. It ends that process if the folder belongs to its own user.

    A note of another user is ignored, and so is -1, which would stand for all processes of the
    user. `os.kill` is replaced, so nothing is ended here.
    """
    folder = tmp_path / "agent"
    folder.mkdir()
    (folder / file).touch()
    owner = folder.lstat().st_uid
    ended = []
    monkeypatch.setattr(ray_machines.os, "kill", lambda pid, _signal: ended.append(pid))
    monkeypatch.setattr(ray_machines.os, "getuid", lambda: owner if is_own else owner + 1)

    MachineAgent(folder, None)

    assert ended == killed


@pytest.fixture
def address_of_policies(tmp_path):
    """Where workers of a machine reach the processes that have its policies: a path and a key."""
    agent = MachineAgent(tmp_path / "agent", HostSettings())
    yield agent.check(MachineVersions(())).hosts
    agent.close()


def test_a_client_with_the_key_reaches_the_policy_processes_of_a_machine(address_of_policies):
    """The address has a secret key with it. To make the policy would raise an error otherwise."""
    with address_of_policies.connect() as line:
        HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0).close()


def test_a_client_with_another_key_does_not_reach_the_policy_processes(address_of_policies):
    """The address of the processes that have the policies of a machine has a secret key with it.
    With another key, the connection is closed: nothing is received, not even one byte."""
    forged = address_of_policies._replace(key=b"x" * 32)

    with forged.connect() as line:
        assert line.recv(1) == b""


def test_a_client_that_sends_no_key_is_disconnected_from_the_policy_processes(address_of_policies):
    """The address of the processes that have the policies of a machine has a secret key with it. A
    client that connects and says nothing is disconnected: not even one byte is received."""
    with socket.socket(socket.AF_UNIX) as silent_client:
        silent_client.connect(address_of_policies.path)

        assert silent_client.recv(1) == b""


def test_the_socket_to_the_policy_processes_goes_away_with_the_agent_of_the_machine(tmp_path):
    """The agent is the process of a machine that looks after its policies; the socket is a file."""
    agent = MachineAgent(tmp_path / "agent", HostSettings())
    socket_file = Path(agent.check(MachineVersions(())).hosts.path)
    assert socket_file.exists()

    agent.close()

    assert not socket_file.exists()
