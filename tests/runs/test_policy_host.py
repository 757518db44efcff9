"""Policies in a process of their own: same records, whoever shares the host, whatever dies."""

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
from roboirg.runs.plan.plan_sections import Hosting
from roboirg.runs.run import ray_machines
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.ray_machines import MachineAgent, MachineVersions
from roboirg.runs.run.runner import run_plan
from roboirg.util.process_guard import descendants

NUMBER_OF_KILLS = int(os.environ.get("ROBOIRG_TEST_KILLS", "8"))
THREE_POLICIES = tuple(f"hosting_fakes:{name}" for name in ("Dice", "BatchedDice", "Picky"))


@pytest.fixture
def host_pool_of_test():
    with HostPool(HostSettings()) as opened:
        yield opened


@pytest.fixture
def write_policy(tmp_path, monkeypatch):
    """Return what writes a module of a name with a class ``It``, and returns its spec.

    The module has imported os, pathlib, sys, time, numpy and hostile_policies.
    """

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


def records_by_job(plan, folder, executor):
    """Run a plan in worlds without a simulator, and return what its records have in common."""
    folder.mkdir(exist_ok=True)
    run_plan(plan, folder, fake_world_runner(plan, folder), executor)
    return {record.identity: comparable(record) for record in read_records(folder)}


# Arrays


def relayed(call):
    """Return a call as it arrives at the other end of a line."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        threading.Thread(target=send, args=(ours, call)).start()
        return receive_call(theirs)


@pytest.mark.parametrize(
    "value",
    [
        [{"a": np.arange(6, dtype=np.int16).reshape(2, 3)}, {"a": np.float32(2.5)}],
        np.zeros((0, 256, 256, 3), np.uint8),
        np.arange(12.0).reshape(3, 4).T,
        np.arange(10**6),
        "pick",
    ],
    ids=["nested", "empty", "not contiguous", "large", "text"],
)
def test_values_of_every_kind_arrive_unchanged_over_two_sockets(value):
    """Between the world's process and the policy's stands a third, so a value is sent twice."""
    found = relayed(relayed(Call("act", value=value))).value
    np.testing.assert_equal(found, value)


def test_a_policy_may_write_into_an_array_that_it_gets():
    """The array arrives as a copy that can be changed, not as a view of the bytes received."""
    found = relayed(Call("act", value=np.zeros(2))).value

    found[0] = 7.0

    assert found.tolist() == [7.0, 0.0]


@pytest.mark.parametrize("value", [object(), np.array([object()]), {"world": FakeWorldRunner}])
def test_objects_are_not_sent_to_the_process_of_a_policy(value):
    """Only plain data and arrays are: an object could carry the goal, or code."""
    with pytest.raises(TypeError):
        send(socket.socket(), Call("act", value=value))


def test_a_policy_in_its_own_process_gets_the_instruction_the_video_and_later_utterances(
    begun_policy,
):
    """The policy notes what it gets in its metadata; numbers of NumPy arrive there as plain ones.

    Its video has 30 pictures whose pixels are all 1, so that the sum is their number. Usage that is
    no finite number is left out; to close twice does no harm.
    """
    policy = begun_policy(
        "notes_what_it_gets",
        """
class It:
    def reset(self, instruction, demonstration):
        video = demonstration["front_rgb"]
        self.metadata = {"instruction": instruction, "fields": list(demonstration)}
        self.metadata |= {"sum": video.sum(dtype=np.int64), "shape": np.array(video.shape)}
    def hear(self, text, step):
        self.metadata["heard"] = [text, step]
    def act(self, observation):
        pass
    def usage(self):
        return {"calls": 2, "cost": float("nan")}
""",
    )
    frames = np.ones((30, 256, 256, 3), np.uint8)

    policy.reset("Pick it.", {"front_rgb": frames, "joint_positions": np.zeros((30, 7))})
    policy.hear("The blue one.", 3)

    assert policy.metadata == {
        "instruction": "Pick it.",
        "fields": ["front_rgb", "joint_positions"],
        "sum": 30 * 256 * 256 * 3,
        "shape": [30, 256, 256, 3],
        "heard": ["The blue one.", 3],
    }
    assert policy.usage() == {"calls": 2.0}, "what is no finite number is no usage"
    policy.close()
    policy.close()  # again does no harm


def test_a_policy_in_its_own_process_answers_to_an_observation_and_cannot_change_it(begun_policy):
    """The policy blackens its picture and answers with the mean of the picture in the history.

    All pixels are 9, so the answer is 9; the world's own picture is still 9, as the policy has a
    copy.
    """
    policy = begun_policy(
        "writes_into_pictures",
        """
class It(hostile_policies.Hostile):
    def act(self, observation):
        assert isinstance(observation["history"], tuple)
        observation["front_rgb"][:] = 0
        return np.full((2, 8), observation["history"][0]["front_rgb"].mean())
""",
    )
    picture = np.full((256, 256, 3), 9, np.uint8)
    policy.reset("Pick it.", {})

    actions = policy.act({"front_rgb": picture, "history": ({"front_rgb": picture},)})

    assert np.array_equal(actions, np.full((2, 8), 9.0))
    assert (picture == 9).all()
    policy.close()


def test_needs_and_seed_of_a_policy_in_its_own_process_are_those_that_it_has_there(
    host_pool_of_test, write_policy
):
    """`grounded` is left out: pixels of subgoals are for privileged policies only."""
    spec = write_policy(
        "needy",
        """
class It(hostile_policies.Hostile):
    observe_every = 4
    depth = grounded = True
    cameras = ("front",)
    prompt_tokens = property(lambda self: 7)
    def __init__(self, seed=0):
        self.metadata = {"seed": seed}
    def reset(self, instruction, demonstration):
        pass
""",
    )

    policy = HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 5)

    assert PolicyNeeds.of(policy) == PolicyNeeds(
        observe_every=4, depth=True, prompt_tokens=7, cameras=("front",)
    )
    policy.reset("Pick it.", {})
    assert policy.metadata == {"seed": 5}
    policy.close()


class VideoThatNotesWhatIsDrawn(dict[str, Any]):
    """A video whose pictures are drawn when they are read; `drawn` has their names."""

    def __init__(self):
        pictures = np.zeros((2, 4, 4, 3), np.uint8)
        super().__init__(joint_positions=np.zeros((2, 7)), front_rgb=pictures, wrist_rgb=pictures)
        self.drawn = []

    def __getitem__(self, field):
        self.drawn.append(field)
        return super().__getitem__(field)


def test_pictures_of_a_video_are_drawn_only_for_a_policy_that_reads_them(
    host_pool_of_test, write_policy
):
    """In its first episode the policy asks for each; in the next all that it read are sent."""
    spec = write_policy(
        "reads_wrist_later",
        """
class It:
    def reset(self, instruction, demonstration):
        demonstration["front_rgb"]
        self.video = demonstration
        self.metadata = {}
    def act(self, observation):
        self.video["wrist_rgb"]
        return np.zeros((1, 8))
""",
    )
    drawn_by_reset = []

    for _ in range(2):
        video = VideoThatNotesWhatIsDrawn()
        policy = HostedPolicy(host_pool_of_test.connect(), read_policy(spec), 0)
        policy.reset("Pick it.", video)
        drawn_by_reset.append(sorted(video.drawn))
        policy.act({})
        policy.close()

    assert drawn_by_reset == [
        ["front_rgb", "joint_positions"],
        ["front_rgb", "joint_positions", "wrist_rgb"],
    ]


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
    """The expected records are those of policies in the world's own process, one episode at a time.

    Some episodes of `Picky` raise: what fails for one of a batch costs only that one. BatchedDice
    and Picky note how many episodes they were asked about at once: no more than a batch or the
    workers; of three workers two can wait while one is asked about.
    """
    monkeypatch.setenv("ROBOIRG_TEST_SIZES", str(tmp_path / "sizes"))
    plan = changed(fake_world_plan("Dice", batch=batch), policies=THREE_POLICIES)
    executor = InProcess()
    if workers:
        executor = LocalProcesses(workers)

    found = records_by_job(plan, tmp_path / "run", executor)

    assert found == records_without_a_host
    assert {record["outcome"] for record in found.values()} == {"success", "failure", "error"}
    sizes = [int(line) for line in (tmp_path / "sizes").read_text().split()]
    assert max(sizes) <= min(batch, max(workers, 1))
    if workers > 2:  # of three, two wait while one is asked about
        assert max(sizes) > 1


def test_all_worlds_share_one_object_of_a_batched_policy(host_pool_of_test):
    """It tells in its metadata how many of it were made."""
    ref = read_policy("hosting_fakes:BatchedDice")
    worlds = [HostedPolicy(host_pool_of_test.connect(), ref, seed) for seed in range(3)]

    for world in worlds:
        world.reset("Pick it.", {})

    assert [world.metadata for world in worlds] == [{"made": 1}] * 3
    for world in worlds:
        world.close()


def test_a_privileged_policy_runs_in_the_worlds_process_and_reads_its_secret(
    tmp_path, write_policy
):
    """A policy with a method attach() gets the world itself, which is in no other process."""
    spec = write_policy(
        "insider",
        """
class It:
    cameras = ()
    def attach(self, env):
        self.env = env
    def reset(self, instruction, demonstration):
        self.metadata = {"secret": self.env.secret, "process": os.getpid()}
    def act(self, observation):
        return np.ones((24, 8))
""",
    )
    plan = fake_world_plan(f"privileged:{spec}", 1).checked()

    records_by_job(plan, tmp_path / "run", InProcess())

    (record,) = read_records(tmp_path / "run")
    assert record.privileged
    assert record.policy_metadata["process"] == os.getpid()
    assert "the goal is the cube" in record.policy_metadata["secret"]


def test_worlds_share_one_process_of_a_policy_on_each_device(write_policy):
    """Four worlds and two devices, 0 and 3: the policy tells its device and process."""
    spec = write_policy(
        "located",
        """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {"device": os.environ["CUDA_VISIBLE_DEVICES"], "process": os.getpid()}
""",
    )
    with HostPool(Hosting(devices=("0", "3")).settings or HostSettings()) as pool:
        worlds = [HostedPolicy(pool.connect(), read_policy(spec), 0) for _ in range(4)]
        for world in worlds:
            world.reset("Pick it.", {})
        found = [(world.metadata["device"], world.metadata["process"]) for world in worlds]

    assert sorted(device for device, _ in found) == ["0", "0", "3", "3"]
    assert len({process for _, process in found}) == 2


# What a policy is


@pytest.mark.parametrize(
    ("spec", "is_hosted", "is_foreign"),
    [
        ("somewhere:Mine", True, True),
        ("system:{folder}/mine.toml", True, True),
        ("lerobot://some/checkpoint", True, False),
        ("oracle", False, False),
        ("openpi://localhost:1", False, False),
        ("system:GroundSG-QwenVL", False, False),
    ],
)
def test_policies_of_a_users_code_get_a_process_and_built_in_ones_and_servers_do_not(
    tmp_path, spec, is_hosted, is_foreign
):
    """*Hosted* ones get a process; *foreign* is code that is not of this package."""
    (tmp_path / "mine.toml").write_text('name = "mine"\npolicy = "somewhere:Mine"\n')

    policy = read_policy(spec.format(folder=tmp_path))

    assert (policy.is_hosted, policy.is_foreign) == (is_hosted, is_foreign)


def test_a_policy_whose_import_takes_too_long_is_refused(write_policy):
    with pytest.raises(InvalidValueError, match=r"not opened within 0[.]5 s"):
        open_policy(read_policy(write_policy("endless", "time.sleep(3600)")), 0.5)


def test_version_and_needs_of_a_policy_are_read_without_importing_it_here(write_policy):
    """The module `versioned` is imported in another process, which tells what it found."""
    spec = write_policy(
        "versioned",
        """
class It(hostile_policies.Hostile):
    version = "2.1"
    prompt_tokens = 9
    cameras = property(lambda self: ("front",))
""",
    )

    found = open_policy(read_policy(spec))

    assert found.version == "2.1"
    assert found.needs == PolicyNeeds(prompt_tokens=9, cameras=("front",))
    assert "versioned" not in sys.modules


def test_a_policys_version_is_shortened_and_its_control_characters_are_escaped(write_policy):
    """So that it never controls the terminal that it is printed on."""
    spec = write_policy(
        "controls_terminals",
        """
class It(hostile_policies.Hostile):
    version = "\\x1b[2J\\u202e\\n-\\ud800" + "7" * 500
""",
    )

    version = open_policy(read_policy(spec)).version

    assert version.startswith(r"\x1b[2J\u202e\n-?77")
    assert len(version) < 220


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
    ids=["exit", "missing package"],
)
def test_a_policy_that_cannot_be_loaded_is_reported_before_the_run(
    text, error, words, write_policy
):
    """The module of the policy has this text; checking the plan already reports what is wrong."""
    plan = fake_world_plan(write_policy("broken", text), 1)

    with pytest.raises(error, match=words):
        plan.checked()


# Deaths


def child_of(host_pool_of_test):
    (child,) = host_pool_of_test._children.values()
    return child


CODE_OF_A_POLICY_THAT_DIES_IF_TOLD = """
class It:
    def reset(self, instruction, demonstration):
        self.word = instruction
    def act(self, observation):
        if self.word == "die":
            print("last words")
            os._exit(7)
        return np.zeros((1, 8))
"""


def test_a_crash_of_a_policys_process_is_an_error_only_for_the_episode_that_caused_it(
    host_pool_of_test, write_policy
):
    """The other episodes are lost, and so played again."""
    ref = read_policy(write_policy("fragile", CODE_OF_A_POLICY_THAT_DIES_IF_TOLD))
    good, bad, over = (HostedPolicy(host_pool_of_test.connect(), ref, 0) for _ in range(3))
    good.reset("live", {})
    bad.reset("die", {})

    with pytest.raises(EpisodeError) as guilty:
        bad.act({})

    assert guilty.value.kind == "policy"
    assert str(guilty.value) == "the process ended with exit code 7 in the policy's act()"
    with pytest.raises(EpisodeLostError):
        good.act({})
    with pytest.raises(EpisodeLostError):
        over.usage()  # what it has cost is lost


def test_after_a_crash_a_policy_gets_a_new_process(host_pool_of_test, write_policy):
    """A policy that was told to die ends its process with exit code 7 when it is asked to act.

    The next episode gets a new process and an answer of one action.
    """
    ref = read_policy(write_policy("fragile", CODE_OF_A_POLICY_THAT_DIES_IF_TOLD))
    bad = HostedPolicy(host_pool_of_test.connect(), ref, 0)
    bad.reset("die", {})
    with pytest.raises(EpisodeError):
        bad.act({})
    # Each episode that asks gets the same answer.
    child = child_of(host_pool_of_test)
    expected = Loss("policy", "the process ended with exit code 7", b"last words\n")
    assert child.loss() == child.loss() == expected
    bad.close()

    again = HostedPolicy(host_pool_of_test.connect(), ref, 0)

    again.reset("live", {})
    assert again.act({}).shape == (1, 8)
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
        world.act({})
    assert lost.value.alone


def test_an_episode_whose_policy_process_cannot_be_started_is_lost(host_pool_of_test, monkeypatch):
    monkeypatch.setattr(host_pool, "PolicyChild", lambda _environment: os.open("/nonexistent", 0))

    with pytest.raises(EpisodeLostError, match="could not be started"):
        HostedPolicy(host_pool_of_test.connect(), read_policy("hosting_fakes:Dice"), 0)


def test_an_interrupt_while_a_picture_is_drawn_stops_the_world_and_not_the_policys_process(
    host_pool_of_test,
):
    """Ctrl-C comes while the policy waits for a picture of the video; later it still answers."""

    class InterruptedVideo(dict[str, Any]):
        def __getitem__(self, field):
            raise KeyboardInterrupt

    world = HostedPolicy(host_pool_of_test.connect(), read_policy("hosting_fakes:Dice"), 0)

    with pytest.raises(KeyboardInterrupt):
        world.reset("Pick it.", InterruptedVideo(front_rgb=None))

    assert world.usage() == {}
    world.close()


def test_a_policys_process_serves_other_worlds_after_one_died_in_the_middle_of_a_message(
    host_pool_of_test,
):
    """A message begins with its length in 8 bytes, here 1000; only 14 bytes follow."""
    ref = read_policy("hosting_fakes:Dice")
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
        worlds[1].act({})

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


def test_a_process_that_is_starting_is_not_ended_as_frozen():
    """After 0.01 s it cannot have answered yet."""
    starting = PolicyChild(os.environ)

    starting.check(0.01)

    assert not starting.is_over
    starting.end()


def test_a_process_that_waits_for_a_picture_is_not_ended_as_frozen(host_pool_of_test, begun_policy):
    """The policy adds up the pixels of a video, whose pictures are drawn when it reads them.

    While one is drawn, the process is checked as if it had been silent for 10 s. It goes on: all of
    2 * 4 * 4 * 3 pixels are 1.
    """
    text = """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {"sum": int(demonstration["front_rgb"].sum())}
"""
    world = begun_policy("viewer", text)

    class VideoCheckedWhileDrawn(dict[str, Any]):
        def __getitem__(self, field):
            child_of(host_pool_of_test).check(10.0)  # of a world that waits
            return super().__getitem__(field)

    world.reset("Pick it.", VideoCheckedWhileDrawn(front_rgb=np.ones((2, 4, 4, 3), np.uint8)))

    assert world.metadata == {"sum": 2 * 4 * 4 * 3}
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

            def draw(question):
                seconds[0] += 1000.0
                return Call("answer", value=question.fields)

            outcome = line.call(Call("act"), draw)

            assert outcome.message == "done"
            assert [receive_call(process).method for _ in range(2)] == ["act", "answer"]


def test_a_frozen_process_is_noticed_although_it_had_sent_many_answers_in_advance(
    host_pool_of_test, begun_policy
):
    """Its answers to *are you alive?*: "!", a thousand times."""
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
    picture = {"front_rgb": np.zeros((2000, 2000, 3), np.uint8)}

    with pytest.raises(EpisodeError, match=r"did not begin the policy's act.., though"):
        world.act(picture)


def test_a_message_that_arrives_byte_by_byte_is_ended_at_the_time_limit_of_a_call(begun_policy):
    """The policy announces 1000 bytes and sends one every 0.1 s; the call may take 0.5 s.

    Would find a limit that begins anew with each byte.
    """
    text = """
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        line = hostile_policies.line_of(hostile_policies.host_of(sys._getframe()))
        line.sendall((1000).to_bytes(8, "big"))
        while True:
            time.sleep(0.1)
            line.sendall(b"0")
"""
    world = begun_policy("piecemeal", text)
    world._line._limit_s = 0.5

    with pytest.raises(EpisodeError, match=r"did not return within 0[.]5 s"):
        world.reset("slowly", {})


def test_a_message_that_begins_before_its_call_loses_the_episode(begun_policy):
    """It announces 1,000 bytes after the outcome of a call, and sends nothing of them."""
    text = """
from roboirg.runs.hosting import host_process
from roboirg.runs.hosting.messages import Outcome, send
class It(hostile_policies.Hostile):
    def reset(self, instruction, demonstration):
        def reply(line, message):
            send(line, message)
            if isinstance(message, Outcome):
                line.sendall((1000).to_bytes(8, "big"))
        host_process.send = reply
"""
    world = begun_policy("early", text)
    world.reset("too early", {})

    with pytest.raises(EpisodeLostError, match="a message of 1,000 bytes"):
        world.reset("again", {})


def host_pids(supervisor):
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
    """Killed are policies' processes, workers, and the run itself, which is then begun again."""
    folder = tmp_path / "killed"
    folder.mkdir()
    undisturbed = records_by_job(hosting_fakes.KILLED_PLAN, tmp_path / "undisturbed", InProcess())
    command = [sys.executable, hosting_fakes.__file__, str(folder)]
    rng = random.Random(0)
    kills = 0

    child = subprocess.Popen(command)
    for _ in range(NUMBER_OF_KILLS):
        time.sleep(rng.uniform(0.1, 1.5))
        if child.poll() is not None:
            child = subprocess.Popen(command)
            continue
        workers = [pid for pid in worker_pids(folder) if is_alive(pid)]
        victims = rng.choice([host_pids(child.pid), workers, [child.pid]])
        for victim in victims[:1]:
            with contextlib.suppress(ProcessLookupError):  # it has just ended
                os.kill(victim, signal.SIGKILL)
                kills += 1
    child.wait()
    for _ in range(5):  # what ended in an error is played again
        done = subprocess.run(command, check=False)
        outcomes = {record.outcome for record in read_records(folder)}
        if done.returncode == 0 and "error" not in outcomes:
            break

    found = {record.identity: comparable(record) for record in read_records(folder)}
    assert found == undisturbed
    assert kills > 0
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
    runner = fake_world_runner(plan, tmp_path, seconds=2.0)

    (record,) = InProcess().run(deque(plan.jobs()), runner)

    assert (record.outcome, record.error, record.attempt) == ("error", "policy", 2)
    assert "the process ended with exit code 5" in str(record.cause)
    assert "last words" in capfd.readouterr().err  # in a worker, of the episode's log


def test_a_worker_is_served_while_idle_clients_may_still_send_their_key(tmp_path, monkeypatch):
    """On a machine of a Ray cluster, where they may be silent for longer than this test lasts."""
    monkeypatch.setattr(ray_machines, "KEY_S", 3600.0)
    agent = MachineAgent(tmp_path / "agent", HostSettings())
    address = agent.check(MachineVersions(())).hosts

    with socket.socket(socket.AF_UNIX) as idle:
        idle.connect(address.path)
        with address.connect() as line:
            HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0).close()

    agent.close()
