"""No policy reaches the goal, the next policy or the run; what it breaks is its own."""

import contextlib
import fcntl
import os
import re
import resource
import signal
import sys
import tempfile
import time
from collections import deque
from pathlib import Path

import hostile_policies
import pytest
from hosting_fakes import FakeWorld, FakeWorldRunner, fake_world_plan, fake_world_runner
from msgspec.structs import replace
from run_fakes import FakePlay, changed, comparable, is_alive, small_plan

from roboirg.cli.options import add_working_directory
from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.episode_log import logged_slugs
from roboirg.records.record_codec import StoreError, encode, read_record
from roboirg.records.store import read_records
from roboirg.runs.episode_errors import EpisodeError, Terminated
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.hosted_policy import HostedPolicy
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.call_guard import attribute_errors
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.runner import run_plan
from roboirg.tasks.splits.private_splits import SALT_VARIABLE
from roboirg.util.process_guard import descendants

HONEST_POLICY = "hosting_fakes:Dice"
on_linux = pytest.mark.skipif(
    sys.platform != "linux", reason="subreapers and /proc are those of Linux"
)


def records_of_each_policy(folder, names, episodes=2, **options):
    """Play some episodes of each hostile policy, and of an honest one after it.

    The honest one that comes after ``Leaker`` is called ``Leaker+1``. With one episode each there
    are no honest ones. Returns lists of records by the name of their policy.
    """
    specs = []
    for name in names:
        specs += [hostile_policies.SPEC(name), f"{name}+1={HONEST_POLICY}"]
    if episodes == 1:  # what is left behind, not what comes after
        specs = specs[::2]
    plan = changed(fake_world_plan("Dice", episodes), policies=specs, tries=1, **options)
    folder.mkdir()
    run_plan(plan, folder, fake_world_runner(plan, folder), LocalProcesses(1))
    found = {}
    for record in read_records(folder):
        found.setdefault(record.policy, []).append(record)
    return found


def records_of_honest_policy_alone(folder):
    """Play two episodes of the honest policy, in this process, and return their records."""
    plan = fake_world_plan("Dice", 2, policy_process="shared")
    return InProcess().run(deque(plan.jobs()), fake_world_runner(plan, folder))


def told_policy(pool, name):
    """Return a hostile policy in a process of its own, which has heard "Pick it."."""
    policy = HostedPolicy(pool.connect(), read_policy(hostile_policies.SPEC(name)), 0)
    policy.reset("Pick it.", {})
    return policy


@pytest.fixture(scope="module")
def hostile_run(tmp_path_factory):
    """All policies that spoil something or search, each with an honest one after it."""
    folder = tmp_path_factory.mktemp("hostile") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder.parent)
        found = records_of_each_policy(
            folder, (*hostile_policies.SPOILED, *hostile_policies.HARMLESS)
        )
    return folder, found


@pytest.mark.slow
@pytest.mark.parametrize(("name", "cause"), hostile_policies.SPOILED.items())
def test_a_policy_that_breaks_its_process_loses_its_own_episodes(hostile_run, name, cause):
    """Each policy has two episodes in the run of the fixture, and breaks something of its process:
    it sends rubbish, closes all files, raises an interrupt, ... Both end in an error that counts as
    the policy's, with a cause that begins as given."""
    _, records = hostile_run

    spoiled = records[hostile_policies.SPEC(name)]

    assert [record.error for record in spoiled] == ["policy", "policy"]
    assert spoiled[0].cause.startswith(cause)


@pytest.mark.slow
@pytest.mark.parametrize("name", hostile_policies.HARMLESS)
def test_a_policy_that_cheats_in_vain_fails_as_any_policy(hostile_run, name):
    """Each policy has two episodes in the run of the fixture, and tries to win them in another way
    than by acting: it searches memory for the goal, or declares itself the winner in its own
    process, ... It does not do the task, so both are failures."""
    _, records = hostile_run

    cheating = records[hostile_policies.SPEC(name)]

    assert [record.outcome for record in cheating] == ["failure", "failure"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*hostile_policies.SPOILED, *hostile_policies.HARMLESS])
def test_an_honest_policy_has_the_same_outcomes_after_a_hostile_one_as_alone(
    hostile_run, tmp_path, name
):
    """In the run of the fixture each hostile policy, which cheats or breaks something, was followed
    by two episodes of an honest one, named as the hostile one with "+1".

    Their outcomes are those of the honest one alone, and they have no log: it prints nothing, and
    what the hostile one prints is not taken for its.
    """
    folder, records = hostile_run
    alone = records_of_honest_policy_alone(tmp_path)

    honest = records[f"{name}+1"]

    outcomes_alone = {record.episode: record.outcome for record in alone}
    assert {record.episode: record.outcome for record in honest} == outcomes_alone
    assert {record.slug for record in honest}.isdisjoint(logged_slugs(folder))


@pytest.mark.slow
def test_a_policy_finds_no_goal_in_its_own_process(hostile_run):
    """`Searcher` looks through every object and frame of its process, and reports as its metadata
    whether it has found the world, the job and the goal. The fixture has its two episodes."""
    _, records = hostile_run

    first, second = records[hostile_policies.SPEC("Searcher")]

    nothing = {"world": False, "job": False, "goal": False}
    assert (first.policy_metadata, second.policy_metadata) == (nothing, nothing)


def test_a_policy_that_searches_the_worlds_process_finds_the_goal_there():
    """Without this, it would prove nothing that a policy in a process of its own finds no goal.

    `Searcher` looks through every object and frame of its process, and reports whether it has found
    the world, the job and the goal. Here they are in its process: `FakeWorld`, which stands in for
    the simulator, has a text with the goal in it, its secret.
    """
    searcher = hostile_policies.Searcher()
    job = fake_world_plan("Dice", 2, policy_process="shared").jobs()[0]
    world = FakeWorld(job)

    searcher.reset(world.secret, {})

    assert searcher.metadata == {"world": True, "job": True, "goal": True}, job


@pytest.mark.slow
def test_impossible_usage_that_a_policy_reports_is_left_out(hostile_run):
    """`Debtor` reports as its usage costs of −1e300 $, 1e308 calls and 5 tokens in each of its
    episodes in the run of the fixture. Only the tokens can be true."""
    _, records = hostile_run

    for record in records[hostile_policies.SPEC("Debtor")]:
        assert record.usage == {"input_tokens": 5.0}


@pytest.mark.slow
def test_what_a_policy_prints_is_in_the_logs_of_its_own_episodes(hostile_run):
    """`Printer` prints 131 million letters in each of its two episodes. The run has the logs in its
    folder, a file for each episode in which something is printed."""
    folder, records = hostile_run

    printing = {record.slug for record in records[hostile_policies.SPEC("Printer")]}

    assert len(printing) == 2
    assert printing <= set(logged_slugs(folder))


@pytest.mark.slow
def test_policies_that_print_or_change_the_folder_leave_the_runs_terminal_and_folder_alone(
    tmp_path, monkeypatch, capfd
):
    """Four policies do in their episodes what their names say: `Printer` prints, `Wanderer` changes
    the working folder, `Leaker` leaves a thread that does so, `Closer` closes all files.

    Each does so in a process of its own, so nothing of it is seen here, in the process of the run.
    An honest policy plays after each, which makes eight.
    """
    monkeypatch.chdir(tmp_path)

    records = records_of_each_policy(tmp_path / "run", ("Printer", "Wanderer", "Leaker", "Closer"))

    printed = capfd.readouterr()
    assert len(records) == 8
    assert Path.cwd() == tmp_path
    assert printed.out + printed.err == ""


@pytest.fixture(scope="module")
def records_of_forgers(tmp_path_factory):
    folder = tmp_path_factory.mktemp("forgers")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOSTILE_NOTES", str(folder))
        return records_of_each_policy(folder / "run", hostile_policies.FORGED, episodes=1)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "cause"), hostile_policies.FORGED.items())
def test_a_forged_reply_is_an_error_of_its_episode(records_of_forgers, name, cause):
    """A policy in a process of its own sends its actions as messages. Each of these policies sends
    what it must not: a message that only the supervisor may send, an array that lies about its
    size, a second reply, metadata that claim to be of a server, ...

    Its one episode ends in an error with that cause. It is neither taken for a privileged policy,
    nor for one of another robot or of a server.
    """
    (record,) = records_of_forgers[hostile_policies.SPEC(name)]

    assert record.outcome == "error"
    assert record.cause.startswith(cause)
    assert (record.privileged, record.robot, record.server_version) == (False, None, None)


@pytest.mark.slow
@on_linux
@pytest.mark.parametrize("name", ["Asker", "Forker", "GuardStopper", "Umlauts"])
def test_a_policy_that_leaves_processes_or_asks_much_fails_as_any_and_its_processes_end(
    tmp_path, monkeypatch, name
):
    """`Forker` leaves a process that nothing leads to, `GuardStopper` also stops the one that would
    end it, `Asker` asks the simulator as often as it may, and `Umlauts` has long metadata. None of
    them does the task, which is a failure and no error.

    Each process that a policy leaves makes a file in `notes`, whose name is the id of the process.
    Within a minute after the run none of them is alive.
    """
    notes = tmp_path / "notes"
    notes.mkdir()
    monkeypatch.setenv("HOSTILE_NOTES", str(notes))

    records = records_of_each_policy(tmp_path / "run", (name,), episodes=1)

    (record,) = records[hostile_policies.SPEC(name)]
    assert record.outcome == "failure", record.cause
    until = time.monotonic() + 60
    while any(is_alive(int(note.name)) for note in notes.iterdir()):
        assert time.monotonic() < until
        time.sleep(0.1)


@on_linux
def test_processes_that_a_policy_starts_end_with_it_however_fast_they_multiply(
    tmp_path, monkeypatch
):
    """`Chain` starts a process that starts the next one and exits, and so on without an end. All of
    them hold a lock on the file `lock`.

    When the pool of policies' processes is closed, they end. The lock is free then, so it can be
    taken without waiting (LOCK_NB), which would raise an error otherwise.
    """
    monkeypatch.setenv("HOSTILE_NOTES", str(tmp_path))

    with HostPool(HostSettings()) as pool:
        told_policy(pool, "Chain").act({})

    with (tmp_path / "lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)


@on_linux
def test_a_policy_that_is_killed_for_memory_is_the_machines_error_and_leaves_no_process(
    tmp_path, monkeypatch
):
    """When it should act, `OutOfMemory` starts a process and kills itself with signal 9, as the
    kernel does if there is no memory left. That is no fault of the policy for sure, so the error is
    of the infrastructure.

    The process that it leaves, whose name cannot be read as text, has its id as the name of a file
    in the folder HOSTILE_NOTES. It is ended, too.
    """
    monkeypatch.setenv("HOSTILE_NOTES", str(tmp_path))

    with HostPool(HostSettings()) as pool:
        policy = told_policy(pool, "OutOfMemory")
        with pytest.raises(EpisodeError, match="died of signal 9") as killed:
            policy.act({})

    assert killed.value.kind == "infrastructure"
    (note,) = tmp_path.iterdir()
    assert not is_alive(int(note.name))


CODE_OF_A_POLICY_THAT_LOOKS_FOR_SECRETS = """
import contextlib, os, pathlib
import numpy as np

class It:
    cameras = ()
    def reset(self, instruction, demonstration):
        self.metadata = {"variables": sorted(os.environ), "salt in command lines": False}
        for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
            with contextlib.suppress(OSError):  # it has ended meanwhile
                if b"a very secret salt" in path.read_bytes():
                    self.metadata["salt in command lines"] = True
    def act(self, observation):
        return np.ones((24, 8))
"""


def test_a_plan_that_names_a_variable_for_policies_that_is_not_set_is_refused():
    with pytest.raises(InvalidValueError, match="NOT_SET_HERE is not set here, so policies cannot"):
        fake_world_plan(HONEST_POLICY, 1, policy_env="NOT_SET_HERE").checked()


@pytest.fixture
def few_open_files():
    """This process may open some 30 files more."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = max(map(int, os.listdir("/dev/fd")))  # noqa: PTH208
    resource.setrlimit(resource.RLIMIT_NOFILE, (used + 30, hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.fixture
def long_temporary_folder(tmp_path, monkeypatch):
    """Temporary files lie in a folder whose path is too long for a socket."""
    folder = tmp_path / ("long" * 40)
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)


@pytest.mark.usefixtures("few_open_files", "long_temporary_folder")
def test_an_honest_policy_plays_alike_with_a_long_path_few_files_and_a_leaking_neighbor(tmp_path):
    """The expected records are those of the policy alone, without a process of its own.

    What could disturb it in a process of its own: temporary files, among them sockets, lie in a
    folder with a very long path, and few files may be open. It also plays after `Leaker`, a policy
    that leaves a thread behind, which changes random numbers, folder, modules and variables.
    """
    alone = records_of_honest_policy_alone(tmp_path)

    after_leaker = records_of_each_policy(tmp_path / "run", ("Leaker",))["Leaker+1"]

    assert alike_but_for_the_policys_name(after_leaker) == alike_but_for_the_policys_name(alone)


def alike_but_for_the_policys_name(records):
    """Return records without times and the names of their policy, in an order of their own."""
    return sorted((comparable(record) | {"policy": "", "ref": None} for record in records), key=str)


@pytest.fixture(scope="module")
def honest_policy_in_an_episode():
    """An honest policy in the middle of an episode, in the youngest process below this one."""
    with HostPool(HostSettings()) as pool:
        policy = HostedPolicy(pool.connect(), read_policy(HONEST_POLICY), 3)
        world = FakeWorld(fake_world_plan("Dice", 1).jobs()[0])
        _, info = world.reset()
        policy.reset("Pick the needle in the haystack.", info["demonstration"])
        policy.act(world.observation())
        yield policy
        policy.close()


@on_linux
@pytest.mark.usefixtures("honest_policy_in_an_episode")
def test_no_socket_of_the_run_accepts_connections():
    """The fixture has a policy that plays. Through a socket to which anybody can connect, a policy
    could reach the run. In /proc/net/unix sockets that listen have flags that are not 0; this
    process has sockets, and none of them is among those."""
    files = [path for path in Path("/proc/self/fd").iterdir() if path.is_socket()]
    own_sockets = {str(path.readlink()) for path in files}

    listening = set()
    _head, *lines = Path("/proc/net/unix").read_text().splitlines()
    for line in lines:
        _slot, _count, _protocol, flags, _kind, _state, inode, *_path = line.split()
        if int(flags, 16) != 0:
            listening.add(f"socket:[{inode}]")

    assert own_sockets
    assert own_sockets.isdisjoint(listening)


def test_each_episode_begins_in_the_runs_folder_although_the_last_one_left_it(
    tmp_path, monkeypatch
):
    """The policy `Wanderer` notes in its metadata in which folder it is asked to act, and then goes
    to the root folder. It plays two episodes in one process, and finds the folder of the run, here
    `tmp_path`, in both. Its metadata come with the reply to the next call, `hear`."""
    monkeypatch.chdir(tmp_path)

    folders = []
    with HostPool(HostSettings()) as pool:
        for _episode in range(2):
            policy = told_policy(pool, "Wanderer")
            policy.act({})
            policy.hear("The red one.", 1)
            folders.append(policy.metadata["before"])
            policy.close()

    assert folders == [str(tmp_path), str(tmp_path)]


@pytest.fixture
def play_policy_here(tmp_path, monkeypatch):
    """Return what plays an episode of a policy whose module is in the working folder.

    As for the command, that folder is the last in which this process looks for modules.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    add_working_directory(last=True)

    def play(policy, executor, **options):
        few = {"tasks": "PickXtimes", "settings": "direct", "episodes": "1"}
        plan = make_plan([policy], **few, **options)
        run = tmp_path / "run"
        run_plan(plan, run, fake_world_runner(plan, run), executor)
        (record,) = read_records(run)
        return record

    return play


def test_a_policys_process_has_no_keys_or_salt_of_the_environment_unless_the_plan_names_them(
    tmp_path, monkeypatch, play_policy_here
):
    """A policy reports which variables its process has, and whether the salt, a secret text, stands
    in the command line of any process. The plan names HF_TOKEN as a variable for policies.

    Other keys of services are kept from it. TOKENIZERS_PARALLELISM is no secret, although TOKEN is
    in its name.
    """
    for name in ("OPENAI_API_KEY", "HF_TOKEN", "AWS_ACCESS_KEY_ID", "TOKENIZERS_PARALLELISM"):
        monkeypatch.setenv(name, "secret")
    monkeypatch.setenv(SALT_VARIABLE, "a very secret salt")
    (tmp_path / "reader.py").write_text(CODE_OF_A_POLICY_THAT_LOOKS_FOR_SECRETS)

    record = play_policy_here("reader:It", LocalProcesses(1), policy_env="HF_TOKEN")

    variables = set(record.policy_metadata["variables"])
    assert record.policy_metadata["salt in command lines"] is False
    assert {"HF_TOKEN", "TOKENIZERS_PARALLELISM"} <= variables
    assert not {"OPENAI_API_KEY", "AWS_ACCESS_KEY_ID", SALT_VARIABLE} & variables


CODE_THAT_NOTES_ITS_IMPORT = """
import sys
import numpy as np
with open("imports", "a") as file: file.write(f"{sys.orig_argv}\\n")
class It:
    cameras = ()
    def reset(self, instruction, demonstration): self.metadata = {}
    def act(self, observation): return np.ones((24, 8))
"""


@pytest.mark.parametrize("executor", [LocalProcesses(1), InProcess()], ids=["worker", "here"])
def test_a_policys_module_is_imported_only_in_its_own_process(tmp_path, play_policy_here, executor):
    """The module writes the command line of each process that imports it into the file `imports`.

    These are two: one to read the policy's version before the run, and one to play. Both run the
    program for policies, host_process.py, and neither is the process of the run or its worker.
    """
    (tmp_path / "tattler.py").write_text(CODE_THAT_NOTES_ITS_IMPORT)

    play_policy_here("tattler:It", executor)

    to_read_the_version, to_play = (tmp_path / "imports").read_text().splitlines()
    assert "host_process" in to_read_the_version
    assert "host_process" in to_play


CODE_THAT_NOTES_ITS_PATH = """
import os, sys
import numpy as np
class It:
    cameras = ()
    def reset(self, instruction, demonstration):
        self.metadata = {"first": sys.path[0] == os.getcwd()}
    def act(self, observation): return np.ones((24, 8))
"""


def test_files_next_to_a_policy_shadow_no_module_but_in_its_own_process(tmp_path, play_policy_here):
    """In the working folder there are modules named json, numpy and others, which raise an error if
    they are imported, and note it in a file. Neither the run nor its worker takes them for the ones
    that they need, and the policy finds numpy, which was imported before.

    In the policy's process the folder comes first among the places for modules (`first`).
    """
    for module in ("json", "multiprocessing", "numpy", "roboirg"):
        (tmp_path / f"{module}.py").write_text(
            f"open('imported {module}', 'w').close()\nraise ImportError('shadowed')\n"
        )
    (tmp_path / "neighbor.py").write_text(CODE_THAT_NOTES_ITS_PATH)

    record = play_policy_here("neighbor:It", LocalProcesses(1))

    assert (record.error, record.policy_metadata) == (None, {"first": True})
    assert not list(tmp_path.glob("imported*"))


def memory_of(pid, needle):
    """Return whether the readable memory of a process holds some bytes."""
    maps = Path(f"/proc/{pid}/maps").read_text()
    with Path(f"/proc/{pid}/mem").open("rb", 0) as memory:
        for start, end in re.findall(r"^(\w+)-(\w+) r", maps, re.MULTILINE):
            # Some parts belong to the kernel and cannot be read.
            with contextlib.suppress(OSError, ValueError, OverflowError):
                memory.seek(int(start, 16))
                if needle in memory.read(int(end, 16) - int(start, 16)):
                    return True
    return False


@on_linux
@pytest.mark.usefixtures("honest_policy_in_an_episode")
def test_the_memory_of_a_policys_process_holds_its_instruction_but_not_the_goal():
    """The fixture has a policy in the middle of an episode, which has heard "Pick the needle in the
    haystack."; its process is the youngest below this one.

    The goal, a text that the world has as its secret, is in this process, where the world is: it is
    found here by the same search of all memory that does not find it there.
    """
    *_, policy_process = descendants(os.getpid())
    secret = FakeWorld(fake_world_plan("Dice", 1).jobs()[0]).secret.encode()

    assert memory_of(os.getpid(), secret)
    assert memory_of(policy_process, b"Pick the needle in the haystack.")
    assert not memory_of(policy_process, secret)


@pytest.mark.usefixtures("honest_policy_in_an_episode")
def test_a_policys_process_has_no_terminal():
    """The fixture has a policy in a process, the youngest below this one. It leads a session of its
    own, and a new session has no terminal."""
    *_, policy_process = descendants(os.getpid())

    assert os.getsid(policy_process) == policy_process


def test_a_policy_name_that_cannot_be_written_as_utf8_is_refused():
    """Half of a surrogate pair (U+D800) is no character."""
    with pytest.raises(InvalidValueError, match="name of a policy"):
        make_plan(["x\ud800=random"], tasks="PickXtimes")


class CallsFailuresSuccess(FakeWorldRunner):
    """Calls a failure a success, as a policy could that patches the judge in its own process."""

    def __call__(self, job):
        record = FakePlay()(job)
        return replace(record, outcome="success", cause="picked the wrong cube")


def test_a_failure_that_was_turned_into_a_success_is_noticed_by_its_cause(tmp_path):
    """A failure has a cause, here "picked the wrong cube", and a success has none. What plays here
    turns failures into successes, and leaves the cause, as a policy would do that patches the
    outcome alone. Both records of the plan become errors of the policy."""
    run_plan(small_plan(1), tmp_path, CallsFailuresSuccess(tmp_path), InProcess())

    for record in read_records(tmp_path):
        assert (record.outcome, record.error) == ("error", "policy")
        assert record.cause == "policy: a success came with a cause (picked the wrong cube)"


def test_a_stored_success_that_has_a_cause_is_refused(tmp_path):
    """Only a failure or an error has a cause, so somebody has changed the outcome in this line."""
    record = FakePlay()(small_plan(1).jobs()[0])
    line = encode(replace(record, outcome="success", cause="no"))

    with pytest.raises(StoreError, match="a success has no cause, but there is 'no'"):
        read_record(line, tmp_path, 1)


@pytest.mark.parametrize(
    ("raised", "becomes"), [(Terminated, Terminated), (KeyboardInterrupt, EpisodeError)]
)
def test_in_the_background_sigterm_ends_the_run_and_an_interrupt_is_the_policys_error(
    monkeypatch, raised, becomes
):
    """In a run in the background Ctrl-C is ignored (SIG_IGN), so an interrupt can only come from a
    policy: it becomes the error of an episode. What SIGTERM raises stays what it is."""
    monkeypatch.setattr(signal, "getsignal", lambda _number: signal.SIG_IGN)

    with pytest.raises(becomes), attribute_errors("environment"):
        raise raised


def test_a_policy_that_raises_an_interrupt_in_a_worker_loses_only_its_own_episodes(tmp_path):
    """`Interrupter` raises what Ctrl-C raises, in the process in which the simulator is, too (the
    process is shared). An honest policy, `Interrupter+1`, plays two episodes after it."""
    records = records_of_each_policy(tmp_path / "run", ("Interrupter",), policy_process="shared")

    for record in records[hostile_policies.SPEC("Interrupter")]:
        assert record.cause.startswith("policy: KeyboardInterrupt")
    assert [record.error for record in records["Interrupter+1"]] == [None, None]
