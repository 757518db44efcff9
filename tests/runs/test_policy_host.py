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

NUMBER_OF_KILLS = int(os.environ.get("ROBOIRG_TEST_KILLS", "8"))
THREE_POLICIES = tuple(f"hosting_fakes:{name}" for name in ("Dice", "BatchedDice", "Picky"))


@pytest.fixture
def host_pool_of_test():
    with HostPool(HostSettings()) as opened:
        yield opened


@pytest.fixture
def write_policy(tmp_path, monkeypatch):
    """Return what writes a module of a name with a class ``It``, and returns its spec.

    The module has imported os, pathlib, sys, time, numpy and hostile_policies. `BasePolicy` stands
    still and needs no cameras.
    """

    def write(name, text):
        (tmp_path / f"{name}.py").write_text(
            "import os, pathlib, sys, time\nimport hostile_policies\nimport numpy as np\n"
            f"from hostile_policies import Hostile as BasePolicy\n{text}"
        )
        monkeypatch.syspath_prepend(tmp_path)
        return f"{name}:It"

    return write


@pytest.fixture
def begin_episode(host_pool_of_test):
    """Return what opens a policy for an episode, in the process that all its episodes share."""
    with contextlib.ExitStack() as episodes:

        def begin(spec, seed=0, limit_s=None):
            policy = HostedPolicy(host_pool_of_test.connect(), read_policy(spec), seed, limit_s)
            episodes.callback(policy.close)
            return policy

        yield begin


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
    begin_episode, write_policy
):
    """The policy notes what it gets in its metadata; numbers of NumPy arrive there as plain ones.

    Its video has 30 pictures whose pixels are all 1, so that the sum is their number.
    """
    spec = write_policy(
        "notes_what_it_gets",
        """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        video = demonstration["front_rgb"]
        self.metadata = {"instruction": instruction, "fields": list(demonstration)}
        self.metadata |= {"sum": video.sum(dtype=np.int64), "shape": np.array(video.shape)}
    def hear(self, text, step):
        self.metadata["heard"] = [text, step]
""",
    )
    frames = np.ones((30, 256, 256, 3), np.uint8)
    policy = begin_episode(spec)

    policy.reset("Pick it.", {"front_rgb": frames, "joint_positions": np.zeros((30, 7))})
    policy.hear("The blue one.", 3)

    assert policy.metadata == {
        "instruction": "Pick it.",
        "fields": ["front_rgb", "joint_positions"],
        "sum": 30 * 256 * 256 * 3,
        "shape": [30, 256, 256, 3],
        "heard": ["The blue one.", 3],
    }


def test_usage_of_a_hosted_policy_that_is_no_finite_number_is_left_out(begin_episode, write_policy):
    """The policy's usage is sent from its process to this one: the cost, which is NaN, is not. Once
    the policy is closed, it has none, and to close it again does no harm.
    """
    text = """
class It(BasePolicy):
    def usage(self):
        return {"calls": 2, "cost": float("nan")}
"""
    policy = begin_episode(write_policy("spends", text))

    assert policy.usage() == {"calls": 2.0}

    policy.close()
    policy.close()
    assert policy.usage() == {}


def test_a_policy_in_its_own_process_answers_to_an_observation_and_cannot_change_it(
    begin_episode, write_policy
):
    """The policy blackens its picture and answers with the mean of the picture in the history.

    All pixels are 9, so the answer is 9; the world's own picture is still 9, as the policy has a
    copy.
    """
    text = """
class It(BasePolicy):
    def act(self, observation):
        assert isinstance(observation["history"], tuple)
        observation["front_rgb"][:] = 0
        return np.full((2, 8), observation["history"][0]["front_rgb"].mean())
"""
    policy = begin_episode(write_policy("writes_into_pictures", text))
    picture = np.full((256, 256, 3), 9, np.uint8)
    policy.reset("Pick it.", {})

    actions = policy.act({"front_rgb": picture, "history": ({"front_rgb": picture},)})

    assert np.array_equal(actions, np.full((2, 8), 9.0))
    assert (picture == 9).all()


def test_a_hosted_policy_has_the_needs_that_it_declares_in_its_process(begin_episode, write_policy):
    """The object that stands for the policy here declares the same, also what is a property there.

    `grounded` is left out: it asks for the pixels of subgoals, which only privileged policies get.
    """
    text = """
class It(BasePolicy):
    cameras = ("front",)
    observe_every = 4
    depth = True
    grounded = True
    prompt_tokens = property(lambda self: 7)
"""
    policy = begin_episode(write_policy("needy", text))

    assert PolicyNeeds.of(policy) == PolicyNeeds(
        cameras=("front",), observe_every=4, depth=True, prompt_tokens=7
    )


def test_a_hosted_policy_is_made_with_its_seed(begin_episode, write_policy):
    """The policy, in a process of its own, tells its seed in its metadata."""
    text = """
class It(BasePolicy):
    def __init__(self, seed):
        self.seed = seed
    def reset(self, instruction, demonstration):
        self.metadata = {"seed": self.seed}
"""
    policy = begin_episode(write_policy("seeded", text), seed=5)

    policy.reset("Pick it.", {})

    assert policy.metadata == {"seed": 5}


class VideoThatNotesWhatIsDrawn(dict[str, Any]):
    """A video whose pictures are drawn when they are read; `drawn` has their names."""

    def __init__(self):
        pictures = np.zeros((2, 4, 4, 3), np.uint8)
        super().__init__(joint_positions=np.zeros((2, 7)), front_rgb=pictures, wrist_rgb=pictures)
        self.drawn = []

    def __getitem__(self, field):
        self.drawn.append(field)
        return super().__getitem__(field)


def fields_drawn_for(policy):
    """Return the fields of a video that are drawn while a policy begins an episode."""
    video = VideoThatNotesWhatIsDrawn()
    policy.reset("Pick it.", video)
    return set(video.drawn)


def test_pictures_of_a_video_are_drawn_only_for_a_policy_that_reads_them(
    begin_episode, write_policy
):
    """A video has the fields joint_positions, front_rgb and wrist_rgb; pictures are slow to draw.

    In its first episode a policy asks for each field of pictures when it reads it: this one reads
    the front camera's in reset(), and the wrist's not before act(). In the next episode all that it
    ever read are sent with the reset.
    """
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.video = demonstration
        self.video["front_rgb"]
    def act(self, observation):
        self.video["wrist_rgb"]
        return np.zeros((1, 8))
"""
    spec = write_policy("reads_wrist_later", text)

    first = begin_episode(spec)
    drawn_at_first = fields_drawn_for(first)
    first.act({})
    drawn_later = fields_drawn_for(begin_episode(spec))

    assert drawn_at_first == {"joint_positions", "front_rgb"}
    assert drawn_later == {"joint_positions", "front_rgb", "wrist_rgb"}


# Records


@pytest.fixture(scope="module")
def records_without_a_host(tmp_path_factory):
    """Records of worlds that share no host: the policies are in their process."""
    plan = changed(fake_world_plan("Dice", policy_process="shared"), policies=THREE_POLICIES)
    return records_by_job(plan, tmp_path_factory.mktemp("alone"), InProcess())


@pytest.mark.parametrize(("workers", "batch"), slow_but([(3, 3)], [(3, 3), (0, 16), (5, 16)]))
def test_records_are_the_same_whatever_the_number_of_workers_or_the_size_of_batches(
    tmp_path, records_without_a_host, workers, batch
):
    """Three policies play eight episodes each, in worlds of so many worker processes (0: in this
    one); a policy's own process asks it about `batch` episodes at once at most.

    The expected records are those of policies in the world's process, one episode at a time (the
    fixture). One policy raises in some episodes: of a batch these alone end in an error.
    """
    plan = changed(fake_world_plan("Dice", batch=batch), policies=THREE_POLICIES)
    executor = InProcess()
    if workers:
        executor = LocalProcesses(workers)

    found = records_by_job(plan, tmp_path / "run", executor)

    assert found == records_without_a_host
    assert {record["outcome"] for record in found.values()} == {"success", "failure", "error"}


def test_a_policy_is_asked_about_no_more_episodes_at_once_than_a_batch_has(tmp_path, monkeypatch):
    """A batch has two episodes. Of three workers two wait while the policy is asked about the
    third, and are then asked about together.

    BatchedDice writes how many it is asked about each time into a file, which the variable names.
    """
    sizes = tmp_path / "sizes"
    monkeypatch.setenv("ROBOIRG_TEST_SIZES", str(sizes))

    records_by_job(fake_world_plan("BatchedDice", batch=2), tmp_path / "run", LocalProcesses(3))

    assert max(sizes.read_text().split()) == "2"


def test_all_worlds_share_one_object_of_a_batched_policy(begin_episode):
    """BatchedDice plays many episodes with one object. It tells in its metadata how many of it
    were made: one for three episodes.
    """
    worlds = [begin_episode("hosting_fakes:BatchedDice", seed) for seed in range(3)]

    for world in worlds:
        world.reset("Pick it.", {})

    assert [world.metadata for world in worlds] == [{"made": 1}] * 3


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
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {"device": os.environ["CUDA_VISIBLE_DEVICES"], "process": os.getpid()}
"""
    ref = read_policy(write_policy("located", text))
    with HostPool(Hosting(devices=("0", "3")).settings) as pool:
        worlds = [HostedPolicy(pool.connect(), ref, 0) for _ in range(4)]
        for world in worlds:
            world.reset("Pick it.", {})

    assert sorted(world.metadata["device"] for world in worlds) == ["0", "0", "3", "3"]
    assert len({world.metadata["process"] for world in worlds}) == 2


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
class It(BasePolicy):
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
    """The version begins with codes that clear a terminal, turn text around, and end a line, and
    half a surrogate pair, which becomes *?*; it has 500 digits more.
    """
    spec = write_policy(
        "controls_terminals",
        """
class It(BasePolicy):
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


def process_in(pool):
    """Return the only policy's process of a pool, as its supervisor has it."""
    (process,) = pool._children.values()
    return process


@pytest.fixture
def dies_if_told(write_policy):
    """The spec of a policy whose act() prints *last words* and ends the process with exit code 7,
    if its instruction was *die*; otherwise it returns one action.
    """
    return write_policy(
        "fragile",
        """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {}
        self.word = instruction
    def act(self, observation):
        if self.word == "die":
            print("last words")
            os._exit(7)
        return np.zeros((1, 8))
""",
    )


@pytest.fixture
def crashed_episode(begin_episode, dies_if_told):
    """The error of an episode whose policy has just ended its process in act(), as it was told."""
    policy = begin_episode(dies_if_told)
    policy.reset("die", {})
    with pytest.raises(EpisodeError) as error:
        policy.act({})
    return error.value


def test_a_crash_of_a_policys_process_is_an_error_of_the_episode_that_caused_it(crashed_episode):
    """The process ended with exit code 7 within act(), as the policy was told to die."""
    assert crashed_episode.kind == "policy"
    assert str(crashed_episode) == "the process ended with exit code 7 in the policy's act()"


def test_a_crash_of_a_policys_process_loses_the_other_episodes_that_share_it(
    begin_episode, dies_if_told
):
    """Three episodes share a process, which the act() of one of them ends.

    Whatever the others ask next, they are lost, which is no error: they are played again.
    """
    bad, playing, ending = (begin_episode(dies_if_told) for _ in range(3))
    bad.reset("die", {})
    playing.reset("live", {})
    with pytest.raises(EpisodeError):
        bad.act({})

    with pytest.raises(EpisodeLostError):
        playing.act({})
    with pytest.raises(EpisodeLostError):
        ending.usage()


@pytest.mark.usefixtures("crashed_episode")
def test_all_episodes_learn_the_same_about_the_end_of_a_policys_process(host_pool_of_test):
    """The policy printed *last words* and ended its process with exit code 7."""
    process = process_in(host_pool_of_test)

    first_told = process.loss()
    told_again = process.loss()

    assert first_told == Loss("policy", "the process ended with exit code 7", b"last words\n")
    assert told_again == first_told


@pytest.mark.usefixtures("crashed_episode")
def test_after_a_crash_a_policy_gets_a_new_process(begin_episode, dies_if_told):
    """The next episode gets an answer of one action."""
    again = begin_episode(dies_if_told)
    again.reset("live", {})

    assert again.act({}).shape == (1, 8)


def test_episodes_whose_policy_was_asked_together_and_crashed_are_played_again_one_by_one(
    begin_episode, write_policy
):
    """A policy's process says with `Begun(together)` whether it asks the policy about several
    episodes at once. Here it always says so, as the policy has replaced that message, and then ends
    with exit code 5.

    Any of these episodes may be to blame. So this one is lost, and is to be played again `alone`.
    """
    text = """
from roboirg.runs.hosting import host_process
from roboirg.runs.hosting.messages import Begun
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {}
        host_process.Begun = lambda together: Begun(together=True)
    def act(self, observation):
        os._exit(5)
"""
    world = begin_episode(write_policy("joint", text))
    world.reset("Pick it.", {})

    with pytest.raises(EpisodeLostError, match="exit code 5") as lost:
        world.act({})

    assert lost.value.alone


def test_an_episode_whose_policy_process_cannot_be_started_is_lost(host_pool_of_test, monkeypatch):
    monkeypatch.setattr(host_pool, "PolicyChild", lambda _environment: os.open("/nonexistent", 0))

    with pytest.raises(EpisodeLostError, match="could not be started"):
        HostedPolicy(host_pool_of_test.connect(), read_policy("hosting_fakes:Dice"), 0)


def test_an_interrupt_while_a_picture_is_drawn_stops_the_world_and_not_the_policys_process(
    begin_episode,
):
    """In its reset() the policy Dice reads the pictures of the video, which the world then draws.

    Here the user presses Ctrl-C at this moment: drawing raises KeyboardInterrupt. That ends this
    episode; the policy's process lives on, and serves another one.
    """

    class VideoInterruptedWhileDrawn(dict[str, Any]):
        def __getitem__(self, field):
            raise KeyboardInterrupt

    other = begin_episode("hosting_fakes:Dice")
    interrupted = begin_episode("hosting_fakes:Dice")

    with pytest.raises(KeyboardInterrupt):
        interrupted.reset("Pick it.", VideoInterruptedWhileDrawn(front_rgb=None))

    assert interrupted.usage() == {}  # it has ended
    assert other.usage() == {"calls": 0}


def test_a_policys_process_serves_other_worlds_after_one_died_in_the_middle_of_a_message(
    host_pool_of_test, begin_episode
):
    """A message begins with its length in 8 bytes, here 1000; only 14 bytes follow."""
    line = host_pool_of_test.connect()
    HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0)

    line.sendall((1000).to_bytes(8, "big") + b"half a message")
    line.close()

    assert begin_episode("hosting_fakes:Dice").usage() == {"calls": 0}


def test_a_call_has_its_time_limit_from_when_it_begins(begin_episode, write_policy):
    """Four episodes share a process, which carries out one call after the other, each in 1.5 s.

    The last call returns after 6 s. That is within its limit of 4 s, as it began 1.5 s before.
    """
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {}
        time.sleep(1.5)
"""
    spec = write_policy("slow", text)
    episodes = [begin_episode(spec, limit_s=4.0) for _ in range(4)]

    with ThreadPoolExecutor() as threads:
        calls = [threads.submit(episode.reset, "Pick it.", {}) for episode in episodes]

    assert [call.exception() for call in calls] == [None, None, None, None]


def test_a_frozen_process_is_ended_when_the_limit_of_a_call_is_over(begin_episode):
    """The policy Resident tells the number of its process in its usage. This process is stopped
    (SIGSTOP) between two calls, so that it does not begin the next one.

    After the 4 s that a call may take it is ended. The episode is lost: its call is not to blame.
    """
    world = begin_episode("hosting_fakes:Resident", limit_s=4.0)

    os.kill(int(world.usage()["process"]), signal.SIGSTOP)

    with pytest.raises(EpisodeLostError, match="began no call within 4 s"):
        world.usage()


def test_an_episode_whose_policy_was_ended_by_another_world_is_lost_and_not_to_blame(
    host_pool_of_test, begin_episode, tmp_path, write_policy
):
    """Two episodes share a process. While the call of the second is under way, the first one has
    the process killed, as an episode does whose own call hangs.

    The call that was under way is not to blame, so its episode is lost: it is played again.
    """
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        pathlib.Path(__file__).with_name("has_begun").touch()
        time.sleep(3600)
"""
    spec = write_policy("sleepy", text)
    line_of_first = host_pool_of_test.connect()
    _first = HostedPolicy(line_of_first, read_policy(spec), 0)
    second = begin_episode(spec)

    with ThreadPoolExecutor() as threads:
        call = threads.submit(second.reset, "Pick it.", {})
        while not (tmp_path / "has_begun").exists():
            time.sleep(0.01)
        ask(line_of_first, HostRequest("kill"))

        with pytest.raises(EpisodeLostError, match="another episode broke the process"):
            call.result()


def test_a_process_that_is_starting_is_not_ended_as_frozen():
    """A process that hangs does not answer in time. This one has just been started, and cannot
    have answered after 0.01 s; it is given longer.
    """
    starting = PolicyChild(os.environ)

    starting.check(0.01)

    assert not starting.is_over
    starting.end()


def test_a_process_that_waits_for_a_picture_is_not_ended_as_frozen(
    host_pool_of_test, begin_episode, write_policy
):
    """The policy reads the pictures of the video, and its process waits until the world has drawn
    them.

    Meanwhile the supervisor checks whether the process hangs: it would be ended if it did not
    answer within some 10 s. It answers, gets the picture, and adds up its 2 * 4 * 4 * 3 pixels of
    1.
    """
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {"sum": int(demonstration["front_rgb"].sum())}
"""

    class VideoCheckedWhileDrawn(dict[str, Any]):
        def __getitem__(self, field):
            process_in(host_pool_of_test).check(10.0)
            return super().__getitem__(field)

    world = begin_episode(write_policy("viewer", text))

    world.reset("Pick it.", VideoCheckedWhileDrawn(front_rgb=np.ones((2, 4, 4, 3), np.uint8)))

    assert world.metadata == {"sum": 2 * 4 * 4 * 3}


def test_the_time_that_the_world_takes_to_draw_is_not_that_of_the_policy(monkeypatch):
    """A call may take one second. Within it the policy asks for a picture, and drawing this takes
    the world a thousand seconds, on a clock that the test moves. The call has its outcome.

    The test plays the policy's process: it sends on, in advance, that the call begins, a question
    for a picture, and the outcome.
    """
    clock = [0.0]
    monkeypatch.setattr(policy_line, "time", SimpleNamespace(monotonic=lambda: clock[0]))

    def draw(question):
        clock[0] += 1000.0
        return Call("answer", value=question.fields)

    world, supervisor = socket.socketpair()
    with world, supervisor:
        line = PolicyLine(world, read_policy("random"), limit_s=1.0)
        _, process = receive_request(supervisor)
        assert process is not None
        supervisor.close()  # no one answers, if the call should fail
        with process, contextlib.closing(line):
            send(process, Begun())
            send(process, Question(("front_rgb",)))
            send(process, Outcome(message="done"))

            outcome = line.call(Call("act"), draw)

            received = [receive_call(process).method, receive_call(process).method]

    assert outcome.message == "done"
    assert received == ["act", "answer"]


def test_a_frozen_process_is_noticed_although_it_had_sent_many_answers_in_advance(
    host_pool_of_test, begin_episode, write_policy
):
    """Its supervisor asks a process whether it hangs; the answer is one byte, *!*.

    This process sends a thousand of them before it is asked, and is then stopped (SIGSTOP). Asked,
    it has 0.1 s, and a second more, to answer; as it does not, it is ended.
    """
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {"process": os.getpid()}
        hostile_policies.host_process()._supervisor.send(b"!" * 1000)
"""
    world = begin_episode(write_policy("eager", text))
    world.reset("Pick it.", {})
    os.kill(world.metadata["process"], signal.SIGSTOP)

    process_in(host_pool_of_test).check(0.1)

    assert process_in(host_pool_of_test).is_over


@pytest.mark.parametrize(
    ("at_first", "after_each_check"),
    [
        ("pass", "pass"),
        ("line.sendall((64).to_bytes(8, 'big'))", "line.sendall(b'0')"),
        ("pass", "line.recv(1)"),
    ],
    ids=["says nothing", "sends one of 64 bytes at a time", "takes in one byte at a time"],
)
def test_a_policy_that_never_begins_a_call_is_an_error_although_its_process_is_alive(
    begin_episode, write_policy, monkeypatch, at_first, after_each_check
):
    """A process should receive a call and say that it begins. After the policy's reset() this one
    does nothing any more but to answer *!* whenever its supervisor asks whether it hangs: its
    method `_collect`, which receives calls, is replaced. It may send or take in a byte each time.

    A call may take 0.5 s here (from the reset on, as to start takes longer) and then wait as long
    as other episodes may need: 0.5 s, and 1 s in which their world draws. (MARGIN_S gives a busy
    machine time for the answer.) The call is of 12 MB, more than a line holds.
    """
    text = f"""
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {{}}
        host = hostile_policies.host_process()
        line = hostile_policies.line_to_world()
        def only_answer_checks(_seconds):
            {at_first}
            while True:
                time.sleep(0.05)
                host._supervisor.recv(4096)
                host._supervisor.send(b"!")
                {after_each_check}
        host._collect = only_answer_checks
"""
    world = begin_episode(write_policy("silent", text))
    world.reset("Pick it.", {})
    world._line._limit_s = 0.5
    monkeypatch.setattr("roboirg.runs.hosting.policy_child.DRAW_S", 1.0)
    monkeypatch.setattr("roboirg.runs.hosting.policy_child.MARGIN_S", 60.0)

    with pytest.raises(EpisodeError, match=r"did not begin the policy's act.., though"):
        world.act({"front_rgb": np.zeros((2000, 2000, 3), np.uint8)})


def test_a_message_that_arrives_byte_by_byte_is_ended_at_the_time_limit_of_a_call(
    begin_episode, write_policy
):
    """In its reset() the policy sends a message of its own to the world: it announces 1000 bytes,
    and sends one of them every 0.1 s.

    The limit of 0.5 s for a call does not begin anew with each byte. (It is set after the start,
    which takes longer.)
    """
    text = """
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        line = hostile_policies.line_to_world()
        line.sendall((1000).to_bytes(8, "big"))
        while True:
            time.sleep(0.1)
            line.sendall(b"0")
"""
    world = begin_episode(write_policy("piecemeal", text))
    world._line._limit_s = 0.5

    with pytest.raises(EpisodeError, match=r"did not return within 0[.]5 s"):
        world.reset("slowly", {})


def test_a_message_that_begins_before_its_call_loses_the_episode(begin_episode, write_policy):
    """A message begins with its length in 8 bytes. Right behind the outcome of each call, this
    policy announces another message, of 1,000 bytes: it has replaced the function `send`, with
    which its process sends the outcome.

    So the announcement comes before the next call begins, and may be due to any episode that shares
    the process: this one is lost, which is no error.
    """
    text = """
from roboirg.runs.hosting import host_process
from roboirg.runs.hosting.messages import Outcome, send
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {}
        def send_too_much(line, message):
            send(line, message)
            if isinstance(message, Outcome):
                line.sendall((1000).to_bytes(8, "big"))
        host_process.send = send_too_much
"""
    world = begin_episode(write_policy("early", text))
    world.reset("Pick it.", {})

    with pytest.raises(EpisodeLostError, match="a message of 1,000 bytes"):
        world.act({})


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


def kill_at_random(command, folder, times):
    """Begin a run, and kill one of its processes at random moments: a policy's process, a worker,
    or the run itself, which is then begun again. Return how many were killed.
    """
    rng = random.Random(0)
    kills = 0
    run = subprocess.Popen(command)
    for _ in range(times):
        time.sleep(rng.uniform(0.1, 1.5))
        if run.poll() is not None:
            run = subprocess.Popen(command)
            continue
        workers = [pid for pid in worker_pids(folder) if is_alive(pid)]
        victims = rng.choice([host_pids(run.pid), workers, [run.pid]])
        with contextlib.suppress(ProcessLookupError, IndexError):  # it has just ended, or is none
            os.kill(victims[0], signal.SIGKILL)
            kills += 1
    run.wait()
    return kills


@pytest.mark.slow
def test_a_run_whose_processes_are_killed_at_random_has_the_same_records_in_the_end(tmp_path):
    """Killed are policies' processes, workers, and the run itself, at random moments; then the run
    is begun again up to five times, as episodes that ended in an error are played again.

    Its records are those of a run of the same plan that nothing disturbed, and no worker is left.
    """
    folder = tmp_path / "killed"
    folder.mkdir()
    command = [sys.executable, hosting_fakes.__file__, str(folder)]
    undisturbed = records_by_job(hosting_fakes.KILLED_PLAN, tmp_path / "undisturbed", InProcess())

    kills = kill_at_random(command, folder, NUMBER_OF_KILLS)
    for _ in range(5):
        subprocess.run(command, check=False)

    found = {record.identity: comparable(record) for record in read_records(folder)}
    assert found == undisturbed
    assert kills > 0
    assert not any(map(is_alive, worker_pids(folder)))


def test_an_episode_whose_policy_ends_between_calls_is_repeated_and_then_an_error(
    tmp_path, monkeypatch, write_policy, capfd
):
    """The policy ends its process (exit code 5) 0.6 s after the reset. By then act() has returned,
    as it does at once, and the world is at work on its actions, for 2 s.

    No call is to blame, so the episode is played again. It may be lost twice here (`MAX_LOSSES`):
    the second attempt is an error. What the policy printed is printed again, for the episode's log.
    """
    text = """
import threading
class It(BasePolicy):
    def reset(self, instruction, demonstration):
        self.metadata = {}
        print("last words")
        threading.Timer(0.6, os._exit, [5]).start()
    def act(self, observation):
        return np.ones((1, 8))
"""
    monkeypatch.setattr("roboirg.runs.play.rollout.MAX_LOSSES", 2)
    plan = fake_world_plan(write_policy("deserter", text), 1)
    runner = fake_world_runner(plan, tmp_path, seconds=2.0)

    (record,) = InProcess().run(deque(plan.jobs()), runner)

    assert (record.outcome, record.error, record.attempt) == ("error", "policy", 2)
    assert "the process ended with exit code 5" in str(record.cause)
    assert "last words" in capfd.readouterr().err


def test_a_worker_is_served_while_idle_clients_may_still_send_their_key(tmp_path, monkeypatch):
    """On each machine of a Ray cluster an agent has the policies' processes. Who connects to it
    sends the key of the run first, within `KEY_S` seconds.

    One client connects and stays silent, for which it has an hour here. A worker that connects
    after it is served all the same: its policy answers that it was not called so far.
    """
    monkeypatch.setattr(ray_machines, "KEY_S", 3600.0)
    agent = MachineAgent(tmp_path / "agent", HostSettings())
    address = agent.check(MachineVersions(())).hosts

    with socket.socket(socket.AF_UNIX) as silent:
        silent.connect(address.path)
        with address.connect() as line:
            usage = HostedPolicy(line, read_policy("hosting_fakes:Dice"), 0).usage()
    agent.close()

    assert usage == {"calls": 0}
