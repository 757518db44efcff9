"""Policies in a process of their own: same records, whoever shares the host, whatever dies."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import hosting_fakes
import numpy as np
import pytest
from hosting_fakes import FakeWorldRunner, fake_world_plan, fake_world_runner
from run_fakes import changed, comparable, is_alive, worker_pids
from selection import slow_but

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record import Job
from roboirg.records.store import read_records
from roboirg.runs.episode_errors import EpisodeError, EpisodeLostError
from roboirg.runs.hosting import host_pool, policy_line
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.hosted_policy import HostedPolicy
from roboirg.runs.hosting.messages import (
    Begun,
    Call,
    HostRequest,
    Loss,
    Outcome,
    Question,
    ask,
    receive_call,
    receive_request,
    send,
)
from roboirg.runs.hosting.policy_child import PolicyChild
from roboirg.runs.hosting.policy_line import PolicyLine
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_sections import Hosting
from roboirg.runs.run import ray_machines
from roboirg.runs.run.executor import Executor, InProcess, LocalProcesses
from roboirg.runs.run.ray_machines import MachineAgent, MachineVersions
from roboirg.runs.run.runner import run_plan
from roboirg.util.process_guard import descendants

Write = Callable[[str, str], str]
Host = Callable[[str, str], HostedPolicy]
NUMBER_OF_KILLS = int(os.environ.get("ROBOIRG_TEST_KILLS", "8"))
THREE_POLICIES = tuple(f"hosting_fakes:{name}" for name in ("Dice", "BatchedDice", "Picky"))


@pytest.fixture
def host_pool_of_test():
    with HostPool(HostSettings()) as opened:
        yield opened


@pytest.fixture
def write_policy(tmp_path, monkeypatch):
    """Return what writes a module of a name with a class ``It``, and returns its spec."""

    def write(name, text):
        (tmp_path / f"{name}.py").write_text(
            "import os, pathlib, sys, time\nimport hostile_policies\nimport numpy as np\n" + text
        )
        monkeypatch.syspath_prepend(tmp_path)
        return f"{name}:It"

    return write


@pytest.fixture
def begun_policy(host_pool_of_test, write_policy):
    """Return what writes a policy and begins an episode of it in a process of its own."""
    return lambda name, text: HostedPolicy(
        host_pool_of_test.connect(), read_policy(write_policy(name, text)), 0
    )


def records_by_job(plan: Plan, folder: Path, executor: Executor) -> dict[Job, dict[str, Any]]:
    folder.mkdir(exist_ok=True)
    run_plan(plan, folder, fake_world_runner(plan, folder), executor)
    return {record.identity: comparable(record) for record in read_records(folder)}


# Arrays


def relayed(call: Call) -> Call:
    """Return a call as it arrives at the other end of a line."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        threading.Thread(target=send, args=(ours, call)).start()
        return receive_call(theirs)


def test_arrays_of_every_kind_arrive_unchanged_over_two_sockets_and_can_be_written_to():
    """Between the world's process and the policy's stands a third: two sockets."""
    value = {
        "history": [{"a": np.arange(6, dtype=np.int16).reshape(2, 3)}, {"a": np.float32(2.5)}],
        "none": np.zeros((0, 256, 256, 3), np.uint8),
        "turned": np.arange(12.0).reshape(3, 4).T,
        "large": np.arange(10**6),
        "text": "pick",
    }
    found = relayed(relayed(Call("act", value=value))).value
    np.testing.assert_equal(found, value)

    found["turned"][0, 0] = 7.0  # a policy may write into what it gets


@pytest.mark.parametrize("value", [object(), np.array([object()]), {"world": FakeWorldRunner}])
def test_objects_are_not_sent_to_the_process_of_a_policy(value):
    """Only plain data and arrays are: an object could carry the goal, or code."""
    with pytest.raises(TypeError):
        send(socket.socket(), Call("act", value=value))


def test_a_policy_in_its_own_process_gets_and_gives_what_it_would_next_to_the_world(
    host_pool_of_test, write_policy
):
    spec = write_policy(
        "curious",
        """
class It:
    observe_every = 4
    depth = grounded = True  # pixels of subgoals are for privileged policies only
    prompt_tokens = property(lambda self: 7)
    def __init__(self, seed=0):
        self.metadata = {"seed": seed}
    def reset(self, instruction, demonstration):
        self.metadata["instruction"] = instruction
        self.metadata["fields"] = list(demonstration)
        self.video = demonstration["front_rgb"]
        self.metadata["sum"] = self.video.sum(dtype=np.int64)
        self.metadata["shape"] = np.array(self.video.shape)
    def hear(self, text, step):
        self.metadata["heard"] = [text, step]
    def act(self, observation):
        assert isinstance(observation["history"], tuple)
        first, *_ = observation["history"]
        rows = np.full((2, 8), first["front_rgb"].mean())
        observation["front_rgb"][:] = 0
        return rows
    def usage(self):
        return {"calls": 2, "cost": float("nan")}
""",
    )
    policy = HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 5)
    assert PolicyNeeds.of(policy) == PolicyNeeds(observe_every=4, depth=True, prompt_tokens=7)

    frames = np.random.default_rng(0).integers(0, 255, (30, 256, 256, 3), np.uint8)
    policy.reset("Pick it.", {"front_rgb": frames, "joint_positions": np.zeros((30, 7))})
    assert policy.metadata == {
        "seed": 5,
        "instruction": "Pick it.",
        "fields": ["front_rgb", "joint_positions"],
        "sum": int(frames.sum(dtype=np.int64)),
        "shape": [30, 256, 256, 3],
    }

    picture = np.full((256, 256, 3), 9, np.uint8)
    observation: Any = {"front_rgb": picture, "history": ({"front_rgb": picture},)}
    assert np.array_equal(policy.act(observation), np.full((2, 8), 9.0))
    assert picture.all()  # the world's own is untouched

    policy.hear("The blue one.", 3)
    assert policy.metadata["heard"] == ["The blue one.", 3]
    assert policy.usage() == {"calls": 2.0}

    policy.close()
    policy.close()


def test_pictures_of_a_video_are_drawn_only_for_a_policy_that_reads_them(
    host_pool_of_test, write_policy
):
    spec = write_policy(
        "choosy",
        """
class It:
    def reset(self, instruction, demonstration):
        demonstration["front_rgb"]
        self.video = demonstration
        self.metadata = {}
    def act(self, observation):
        self.video.draw()
        return np.zeros((1, 8))
""",
    )

    class Video(dict[str, Any]):
        drawn: list[str]

        def __getitem__(self, field):
            self.drawn.append(field)
            return super().__getitem__(field)

    drawn = []

    for _ in range(2):
        video = Video(front_rgb=np.zeros((2, 4, 4, 3), np.uint8), joint_positions=np.zeros((2, 7)))
        video["wrist_rgb"] = video["wrist_depth"] = np.zeros((2, 4, 4, 3), np.uint8)
        video.drawn = []
        policy = HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 0)
        policy.reset("Pick it.", video)
        drawn.append(list(video.drawn))
        policy.act({})  # type: ignore[typeddict-item]
        policy.close()
        assert sorted(video.drawn) == sorted(video)

    assert drawn[0] == ["joint_positions", "front_rgb"]
    # The second episode knows what the first one read.
    assert sorted(drawn[1]) == sorted(video)


# Records


@pytest.fixture(scope="module")
def records_without_a_host(tmp_path_factory):
    """Records of worlds that share no host: the policies are in their process."""
    plan = changed(fake_world_plan("Dice", policy_process="shared"), policies=THREE_POLICIES)
    return records_by_job(plan, tmp_path_factory.mktemp("alone"), InProcess())


@pytest.mark.parametrize(("workers", "batch"), slow_but([(3, 3)], [(3, 3), (0, 16), (5, 16)]))
def test_records_are_the_same_whatever_the_number_of_workers_or_the_size_of_batches(
    tmp_path, monkeypatch, records_without_a_host, workers, batch
):
    monkeypatch.setenv("ROBOIRG_TEST_SIZES", str(tmp_path / "sizes"))
    plan = changed(fake_world_plan("Dice", batch=batch), policies=THREE_POLICIES)

    found = records_by_job(
        plan, tmp_path / "run", LocalProcesses(workers) if workers else InProcess()
    )

    assert found == records_without_a_host
    assert {record["outcome"] for record in found.values()} == {"success", "failure", "error"}
    # What fails for one episode of a batch costs only that one.
    causes = {record["cause"] for record in found.values() if record["outcome"] == "error"}
    assert causes == {"policy: ValueError: one of them is bad (hosting_fakes.py, line 188)"}

    sizes = [int(line) for line in (tmp_path / "sizes").read_text().split()]
    assert sum(sizes) == 8 * hosting_fakes.LENGTH / 4
    assert max(sizes) <= min(batch, max(workers, 1))
    if workers > 2:  # of three, two wait while one is asked about
        assert max(sizes) > 1

    # One object, however many worlds there are.
    batched = [record for record in read_records(tmp_path / "run") if "Batched" in record.policy]
    assert {record.policy_metadata["made"] for record in batched} == {1}


def test_a_privileged_policy_runs_in_the_worlds_process_and_reads_its_secret(
    tmp_path, write_policy
):
    spec = write_policy(
        "insider",
        """
class It:
    cameras = ()
    def attach(self, env):
        self.env = env
    def reset(self, instruction, demonstration):
        self.metadata = {"secret": self.env.secret, "process": os.getpid() == os.getppid()}
    def act(self, observation):
        return np.ones((24, 8))
""",
    )
    records_by_job(
        fake_world_plan(f"privileged:{spec}", 1).checked(), tmp_path / "run", InProcess()
    )

    (record,) = read_records(tmp_path / "run")

    assert record.privileged
    assert record.policy == "privileged:insider:It"
    assert "token" in str(record.policy_metadata["secret"])


def test_worlds_share_one_process_of_a_policy_on_each_device(write_policy):
    ref = read_policy(
        write_policy(
            "located",
            """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {"device": os.environ["CUDA_VISIBLE_DEVICES"], "process": os.getpid()}
""",
        )
    )
    with HostPool(Hosting(devices=("0", "3")).settings or HostSettings()) as pool:
        worlds = [HostedPolicy(pool.connect(), ref, 0) for _ in range(4)]
        for world in worlds:
            world.reset("Pick it.", {})
        found = [(world.metadata["device"], world.metadata["process"]) for world in worlds]

    assert sorted(device for device, _ in found) == ["0", "0", "3", "3"]
    assert len(set(found)) == 2


# What a policy is


def test_policies_of_a_users_code_get_a_process_and_built_in_ones_and_servers_do_not(tmp_path):
    """*Hosted* ones get a process; *foreign* is code that is not of this package."""
    (tmp_path / "mine.toml").write_text('name = "mine"\npolicy = "somewhere:Mine"\n')
    foreign = ["somewhere:Mine", f"system:{tmp_path}/mine.toml"]
    ours = ["oracle", "random", "openpi://localhost:1", "system:GroundSG-QwenVL"]

    assert [read_policy(spec).is_foreign for spec in foreign] == [True, True]
    assert [read_policy(spec).is_hosted for spec in foreign] == [True, True]
    assert not any(read_policy(spec).is_hosted for spec in ours)
    assert read_policy("lerobot://some/checkpoint").is_hosted
    assert not read_policy("lerobot://some/checkpoint").is_foreign


def test_a_policy_whose_import_takes_too_long_is_refused(write_policy):
    with pytest.raises(InvalidValueError, match=r"not opened within 0[.]5 s"):
        open_policy(read_policy(write_policy("endless", "time.sleep(3600)")), 0.5)


def test_version_and_needs_of_a_policy_are_read_without_importing_it_here(write_policy):
    spec = write_policy(
        "versioned",
        """
class It:
    version = "\\x1b[2J\\u202e\\n-\\ud800" + "7" * 500
    prompt_tokens = 9
    cameras = property(lambda self: ("front",))
    def reset(self, instruction, demonstration): pass
    def act(self, observation): pass
""",
    )
    found = open_policy(read_policy(spec))

    assert found.version.startswith(r"\x1b[2J\u202e\n-?77")  # never controls a terminal
    assert len(found.version) < 220
    assert found.needs == PolicyNeeds(prompt_tokens=9, cameras=("front",))
    assert not found.is_privileged
    assert "versioned" not in sys.modules
    assert open_policy(read_policy("oracle")).is_privileged


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("os._exit(3)", InvalidValueError, "ended with exit code 3"),
        (
            "from roboirg.core import errors; raise errors.MissingDependencyError('pip it')",
            MissingDependencyError,
            "pip it",
        ),
    ],
)
def test_a_policy_that_cannot_be_loaded_is_reported_before_the_run(
    text, error, words, write_policy
):
    with pytest.raises(error, match=words):
        fake_world_plan(write_policy("broken", text), 1).checked()


# Deaths


def child_of(host_pool_of_test: HostPool) -> PolicyChild:
    (child,) = host_pool_of_test._children.values()
    return child


def test_a_crash_of_a_policys_process_is_an_error_only_for_the_episode_that_caused_it(
    host_pool_of_test, write_policy
):
    spec = write_policy(
        "fragile",
        """
class It:
    def reset(self, instruction, demonstration):
        self.word = instruction
    def act(self, observation):
        if self.word == "die":
            print("last words")
            os._exit(7)
        return np.zeros((1, 8))
""",
    )
    good, bad, over, late = (
        HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 0) for _ in range(4)
    )
    good.reset("live", {})
    bad.reset("die", {})

    assert good.act({}).shape == (1, 8)  # type: ignore[typeddict-item]
    with pytest.raises(EpisodeError) as guilty:
        bad.act({})  # type: ignore[typeddict-item]
    assert guilty.value.kind == "policy"
    assert str(guilty.value) == "the process ended with exit code 7 in the policy's act()"

    child = child_of(host_pool_of_test)
    child.check(0.1)

    # Each episode that asks gets the same answer, even after a check.
    expected = Loss("policy", "the process ended with exit code 7", b"last words\n")
    assert child.loss() == child.loss() == expected
    with pytest.raises(EpisodeLostError):
        good.act({})  # type: ignore[typeddict-item]
    with pytest.raises(EpisodeLostError):
        over.usage()  # what it has cost is lost

    for policy in (good, bad, over, late):
        policy.close()
    again = HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 0)  # in a new process
    again.reset("live", {})
    assert again.act({}).shape == (1, 8)  # type: ignore[typeddict-item]

    again.close()


def test_episodes_whose_policy_was_asked_together_and_crashed_are_played_again_one_by_one(
    begun_policy,
):
    """One of them may be to blame, the others are not; alone it shows."""
    text = """
from roboirg.runs.hosting import host_process
from roboirg.runs.hosting.messages import Begun
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        host_process.Begun = lambda together: Begun(True)
    def act(self, observation):
        os._exit(5)
"""
    world = begun_policy("joint", text)
    world.reset("Pick it.", {})

    with pytest.raises(EpisodeLostError, match="exit code 5") as lost:
        world.act({})  # type: ignore[typeddict-item]
    assert lost.value.alone


def test_a_policys_process_serves_others_after_a_world_died_or_was_interrupted(
    host_pool_of_test, monkeypatch
):
    """Would find an interrupt that is forgotten, and a worker whose calls are not answered."""

    class Video(dict[str, Any]):
        def __getitem__(self, field):
            raise KeyboardInterrupt

    hosts = host_pool_of_test.connect()
    ref = read_policy("hosting_fakes:Dice")
    with monkeypatch.context() as without:
        without.setattr(host_pool, "PolicyChild", lambda _environment: os.open("/nonexistent", 0))
        with pytest.raises(EpisodeLostError, match="could not be started"):
            HostedPolicy(hosts, ref, 0)
    world = HostedPolicy(hosts, ref, 0)

    with pytest.raises(KeyboardInterrupt):
        world.reset("Pick it.", Video(front_rgb=None))
    assert world.usage() == {}

    world.close()
    line = host_pool_of_test.connect()
    HostedPolicy(line, ref, 0)
    line.sendall((1000).to_bytes(8, "big") + b"half a message")
    line.close()
    HostedPolicy(host_pool_of_test.connect(), ref, 1).close()


def test_a_call_has_its_time_limit_from_when_it_begins_and_a_frozen_process_is_ended(
    host_pool_of_test, write_policy
):
    """Four calls of 1.5 s wait for each other; the limit is 4 s. Then the process is stopped.

    Would find a limit that begins when a call is sent, and a wait without any limit.
    """
    spec = write_policy(
        "stopping",
        """
import signal, threading
class It:
    def reset(self, instruction, demonstration):
        time.sleep(1.5)
    def hear(self, text, step):
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGSTOP)).start()
    def act(self, observation):
        return np.zeros((1, 8))
""",
    )
    worlds = [
        HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 0, 4.0) for _ in range(4)
    ]
    with ThreadPoolExecutor() as threads:
        list(threads.map(lambda world: world.reset("wait", {}), worlds))  # the last for 6 s
    worlds[0].hear("stop", 0)
    time.sleep(1)

    with pytest.raises(EpisodeLostError, match="began no call within 4 s"):
        worlds[1].act({})  # type: ignore[typeddict-item]

    for world in worlds:
        world.close()


def test_an_episode_whose_policy_was_ended_by_another_world_is_lost_and_not_to_blame(
    host_pool_of_test, tmp_path, write_policy
):
    """Would catch a call that begins when an earlier one returns just after its limit."""
    text = """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        pathlib.Path(__file__).with_name("begun").touch()
        time.sleep(3600)
"""
    ref = read_policy(write_policy("sleepy", text))
    hosts = host_pool_of_test.connect()
    late = HostedPolicy(hosts, ref, 0)
    world = HostedPolicy(host_pool_of_test.connect(), ref, 0)
    with ThreadPoolExecutor() as threads:
        call = threads.submit(world.reset, "Pick it.", {})
        while not (tmp_path / "begun").exists():
            time.sleep(0.01)
        ask(hosts, HostRequest("kill"))
        with pytest.raises(EpisodeLostError, match="another episode broke the process"):
            call.result()
    late.close()


def test_a_process_that_starts_or_waits_for_a_picture_is_not_ended_as_frozen(
    host_pool_of_test, begun_policy
):
    starting = PolicyChild(os.environ)
    starting.check(0.01)
    assert not starting.is_over

    starting.end()
    text = """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {"sum": int(demonstration["front_rgb"].sum())}
"""
    world = begun_policy("viewer", text)

    class Video(dict[str, Any]):
        def __getitem__(self, field):
            child_of(host_pool_of_test).check(10.0)  # of a world that waits
            return super().__getitem__(field)

    world.reset("Pick it.", Video(front_rgb=np.ones((2, 4, 4, 3), np.uint8)))

    assert world.metadata == {"sum": 96}

    world.close()


def test_the_time_that_the_world_takes_to_draw_is_not_that_of_the_policy(monkeypatch):
    """A call of at most a second asks for a picture, which takes a thousand seconds."""
    seconds = [0.0]
    monkeypatch.setattr(policy_line, "time", SimpleNamespace(monotonic=lambda: seconds[0]))
    world, supervisor = socket.socketpair()
    with world, supervisor:
        line = PolicyLine(world, read_policy("random"), limit_s=1.0)
        _, process = receive_request(supervisor)
        assert process is not None
        supervisor.shutdown(socket.SHUT_RDWR)  # an error is not looked into
        with process, contextlib.closing(line):
            for message in (Begun(), Question(("front_rgb",)), Outcome(message="done")):
                send(process, message)

            def draw(question: Question) -> Call:
                seconds[0] += 1000.0
                return Call("answer", value=question.fields)

            outcome = line.call(Call("act"), draw)

            assert outcome.message == "done"
            assert [receive_call(process).method for _ in range(2)] == ["act", "answer"]


def test_a_frozen_process_is_noticed_although_it_had_sent_many_answers_in_advance(
    host_pool_of_test, begun_policy
):
    text = """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        hostile_policies.host_of(sys._getframe())._supervisor.send(b"!" * 1000)
"""
    world = begun_policy("eager", text)
    world.reset("Pick it.", {})
    *_, pid = descendants(os.getpid())
    os.kill(pid, signal.SIGSTOP)

    child_of(host_pool_of_test).check(0.1)
    assert child_of(host_pool_of_test).is_over

    world.close()


@pytest.mark.parametrize("answer", ["nothing", "half a message", "to take in half a call"])
def test_a_policy_that_never_begins_a_call_is_an_error_although_its_process_is_alive(
    host_pool_of_test, write_policy, monkeypatch, answer
):
    text = """
def answer_checks(supervisor, line, way):
    if way == "half a message":
        line.sendall((64).to_bytes(8, "big"))
    while True:
        time.sleep(0.05)
        supervisor.recv(4096)
        supervisor.send(b"!")
        if way == "half a message":
            line.sendall(b"0")
        if way == "to take in half a call":
            line.recv(1)
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        host = hostile_policies.host_of(sys._getframe())
        line = hostile_policies.line_of(host)
        host._collect = lambda _seconds: answer_checks(host._supervisor, line, instruction)
"""
    world = HostedPolicy(host_pool_of_test.connect(), read_policy(write_policy("silent", text)), 0)
    world.reset(answer, {})
    world._line._limit_s = 0.5
    for name, seconds in (("DRAW_S", 1.0), ("MARGIN_S", 60.0)):
        monkeypatch.setattr(f"roboirg.runs.hosting.policy_child.{name}", seconds)
    picture: Any = {"front_rgb": np.zeros((2000, 2000, 3), np.uint8)}

    with pytest.raises(EpisodeError, match=r"did not begin the policy's act.., though"):
        world.act(picture)


def test_a_message_that_arrives_byte_by_byte_is_ended_at_the_time_limit_of_a_call(
    host_pool_of_test, write_policy
):
    text = """
from roboirg.runs.hosting import host_process
from roboirg.runs.hosting.messages import Outcome, send
head = (1000).to_bytes(8, "big")
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        if instruction == "slowly":
            line = hostile_policies.line_of(hostile_policies.host_of(sys._getframe()))
            line.sendall(head)
            while True:
                time.sleep(0.1)
                line.sendall(b"0")
        def reply(line, message):
            send(line, message)
            if isinstance(message, Outcome):
                line.sendall(head)
        host_process.send = reply
"""
    ref = read_policy(write_policy("piecemeal", text))
    early = HostedPolicy(host_pool_of_test.connect(), ref, 0)
    world = HostedPolicy(host_pool_of_test.connect(), ref, 0)
    early.reset("too early", {})

    with pytest.raises(EpisodeLostError, match="a message of 1,000 bytes"):
        early.reset("again", {})

    world._line._limit_s = 0.5
    with pytest.raises(EpisodeError, match=r"did not return within 0[.]5 s"):
        world.reset("slowly", {})


def host_pids(supervisor: int) -> list[int]:
    """Return the processes that a supervisor started for policies."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            status = (path / "stat").read_text()
            line = (path / "cmdline").read_bytes()
        except OSError:
            continue
        if int(status.rpartition(")")[2].split()[1]) == supervisor and b"host_process" in line:
            found.append(int(path.name))
    return found


@pytest.mark.slow
def test_a_run_whose_processes_are_killed_at_random_has_the_same_records_in_the_end(tmp_path):
    folder = tmp_path / "killed"
    undisturbed = tmp_path / "undisturbed"
    folder.mkdir()
    expected = records_by_job(hosting_fakes.KILLED_PLAN, undisturbed, InProcess())
    command = [sys.executable, hosting_fakes.__file__, str(folder)]
    rng = random.Random(0)
    struck = 0
    child = subprocess.Popen(command)
    for _ in range(NUMBER_OF_KILLS):
        time.sleep(rng.uniform(0.1, 1.5))
        if child.poll() is not None:
            child = subprocess.Popen(command)
            continue
        worlds = [pid for pid in worker_pids(folder) if is_alive(pid)]
        victims = rng.choice([host_pids(child.pid), worlds, [child.pid]])
        for victim in victims[:1]:
            with contextlib.suppress(ProcessLookupError):  # it has just ended
                os.kill(victim, signal.SIGKILL)
                struck += 1
    child.wait()
    for _ in range(5):  # what ended in an error is played again
        done = subprocess.run(command, check=False)
        outcomes = {record.outcome for record in read_records(folder)}
        if done.returncode == 0 and "error" not in outcomes:
            break

    found = {record.identity: comparable(record) for record in read_records(folder)}

    assert found == expected
    assert struck
    assert not any(map(is_alive, worker_pids(folder)))


def test_an_episode_whose_policy_ends_between_calls_is_repeated_and_then_an_error(
    tmp_path, monkeypatch, write_policy, capfd
):
    spec = write_policy(
        "deserter",
        """
import threading
class It:
    cameras = ()
    def reset(self, instruction, demonstration):
        print("last words")
        threading.Timer(0.6, lambda: os._exit(5)).start()  # between two calls
        self.metadata = {}
    def act(self, observation):
        return np.ones((1, 8))
""",
    )
    monkeypatch.setattr("roboirg.runs.play.rollout.MAX_LOSSES", 2)
    plan = fake_world_plan(spec, 1)
    runner: FakeWorldRunner = fake_world_runner(plan, tmp_path, seconds=2.0)

    (record,) = InProcess().run(deque(plan.jobs()), runner)

    assert (record.outcome, record.error, record.attempt) == ("error", "policy", 2)
    assert "the process ended with exit code 5" in str(record.cause)
    assert "last words" in capfd.readouterr().err  # in a worker, of the episode's log


def test_a_worker_is_served_while_idle_clients_may_still_send_their_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a machine of a Ray cluster, where they may be silent for longer than this test lasts."""
    monkeypatch.setattr(ray_machines, "KEY_S", 3600.0)
    agent = MachineAgent(tmp_path / "agent", HostSettings())
    address = agent.check(MachineVersions(())).hosts
    assert address is not None

    with socket.socket(socket.AF_UNIX) as idle:
        idle.connect(address.path)
        with address.connect() as line:
            HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0).close()

    agent.close()
