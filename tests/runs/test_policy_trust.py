"""No policy reaches the goal, the next policy or the run; what it breaks is its own."""

from __future__ import annotations

import fcntl
import os
import re
import resource
import signal
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import hostile_policies
import pytest
from hosting_fakes import PaperRunner, PaperWorld, paper_plan, paper_runner
from msgspec.structs import replace
from run_fakes import FakePlay, changed, comparable, is_alive, small_plan

from roboirg.cli.options import add_working_directory
from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.episode_log import logged_slugs
from roboirg.records.record import Job, Record
from roboirg.records.record_codec import StoreError, encode, read_record
from roboirg.records.store import read_records
from roboirg.runs.episode_errors import EpisodeError, Terminated
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.hosted_policy import HostedPolicy
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.call_guard import attribute_errors
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.runner import run_plan
from roboirg.tasks.splits.private_splits import SALT_VARIABLE
from roboirg.util.process_guard import descendants

HONEST = "hosting_fakes:Dice"


def play(
    folder: Path, names: tuple[str, ...], episodes: int = 2, **options: Any
) -> dict[str, list[Record]]:
    """Play some episodes of each policy, and of an honest one between and after them."""
    specs = [spec for name in names for spec in (hostile_policies.SPEC(name), f"{name}+1={HONEST}")]
    if episodes == 1:  # what is left behind, not what comes after
        specs = specs[::2]
    plan = changed(paper_plan("Dice", episodes), policies=specs, tries=1, **options)
    folder.mkdir()
    run_plan(plan, folder, paper_runner(plan, folder), LocalProcesses(1))
    found: dict[str, list[Record]] = {}
    for record in read_records(folder):
        found.setdefault(record.policy, []).append(record)
    return found


@pytest.fixture(scope="module")
def hostile_run(tmp_path_factory):
    """All policies that spoil something or search, each with an honest one after it."""
    folder = tmp_path_factory.mktemp("hostile") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder.parent)
        found = play(folder, (*hostile_policies.SPOILED, *hostile_policies.HARMLESS))
    return folder, found


@pytest.mark.slow
@pytest.mark.parametrize("name", hostile_policies.SPOILED)
def test_what_a_policy_breaks_is_its_own(hostile_run, name):
    _, found = hostile_run
    records = found[hostile_policies.SPEC(name)]

    assert len(records) == 2
    for record in records:
        assert record.error == "policy", record.cause
        assert str(record.cause).startswith(hostile_policies.SPOILED[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", hostile_policies.HARMLESS)
def test_what_breaks_nothing_fails_as_any_policy(hostile_run, name):
    _, found = hostile_run
    records = found[hostile_policies.SPEC(name)]
    assert [(record.outcome, record.error) for record in records] == [("failure", None)] * 2


@pytest.mark.slow
def test_an_honest_policy_plays_after_each_as_alone(hostile_run, tmp_path):
    folder, found = hostile_run
    plan = paper_plan("Dice", 2, policy_process="shared")
    alone = InProcess().run(deque(plan.jobs()), paper_runner(plan, tmp_path))
    expected = {record.episode: record.outcome for record in alone}

    for name in (*hostile_policies.SPOILED, *hostile_policies.HARMLESS):
        honest = found[f"{name}+1"]
        assert {record.episode: record.outcome for record in honest} == expected, name
        assert len(honest) == 2
        assert {record.slug for record in honest}.isdisjoint(logged_slugs(folder))


@pytest.mark.slow
def test_a_hosted_policy_finds_no_world_in_memory_and_one_beside_it_does(hostile_run, tmp_path):
    _, found = hostile_run
    for record in found[hostile_policies.SPEC("Searcher")]:
        assert record.policy_metadata == {"world": False, "job": False, "goal": False}

    beside = hostile_policies.Searcher()
    job = paper_plan("Dice", 2, policy_process="shared").jobs()[0]
    world = PaperWorld(job)  # both alive while it searches
    beside.reset(world.secret, {})
    assert beside.metadata == {"world": True, "job": True, "goal": True}, job


@pytest.mark.slow
def test_what_a_policy_owes_and_prints_is_stored_as_its_own(hostile_run):
    folder, found = hostile_run
    for record in found[hostile_policies.SPEC("Debtor")]:
        assert record.usage == {"input_tokens": 5.0}

    printed = {record.slug for record in found[hostile_policies.SPEC("Printer")]}
    assert printed <= set(logged_slugs(folder))


@pytest.mark.slow
def test_what_a_policy_prints_or_enters_changes_neither_terminal_nor_folder(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    play(tmp_path / "run", (*hostile_policies.SPOILED, *hostile_policies.HARMLESS))

    assert Path.cwd() == tmp_path
    printed = capfd.readouterr()
    assert printed.out + printed.err == ""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="there are subreapers on Linux")
def test_what_is_forged_is_an_error_of_its_own_episode_and_nothing_started_survives(
    tmp_path, monkeypatch
):
    notes = tmp_path / "notes"
    notes.mkdir()
    monkeypatch.setenv("HOSTILE_NOTES", str(notes))
    names = (*hostile_policies.FORGED, "Asker", "Forker", "GuardStopper", "Umlauts")
    found = play(tmp_path / "run", names, episodes=1)

    for name in names:
        cause = hostile_policies.FORGED.get(name)
        for record in found[hostile_policies.SPEC(name)]:
            assert record.outcome == ("failure" if cause is None else "error"), record.cause
            assert str(record.cause).startswith(cause or ""), record.cause
            assert (record.privileged, record.robot, record.server_version) == (False, None, None)
    assert len(list(notes.iterdir())) > 2

    until = time.monotonic() + 60
    while any(is_alive(int(path.name)) for path in notes.iterdir()):
        assert time.monotonic() < until
        time.sleep(0.1)


@pytest.mark.skipif(sys.platform != "linux", reason="there are subreapers on Linux")
@pytest.mark.parametrize("name", ["Chain", "OutOfMemory"])
def test_what_a_policy_started_ends_with_it_whatever_its_names_and_however_fast_it_forks(
    tmp_path, monkeypatch, name
):
    monkeypatch.setenv("HOSTILE_NOTES", str(tmp_path))
    with HostPool(HostSettings()) as pool:
        policy = HostedPolicy(pool.connect(), read_policy(hostile_policies.SPEC(name)), 0)
        policy.reset("Pick it.", {})
        if name == "Chain":
            policy.act({})  # type: ignore[typeddict-item]
        else:  # the machine's error, not the policy's
            with pytest.raises(EpisodeError, match="died of signal 9") as killed:
                policy.act({})  # type: ignore[typeddict-item]
            assert killed.value.kind == "infrastructure"
    (note,) = tmp_path.iterdir()
    if name == "Chain":
        with note.open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    else:
        assert not is_alive(int(note.name))


READER = """
import contextlib, os, pathlib
import numpy as np

class It:
    cameras = ()
    def reset(self, instruction, demonstration):
        self.metadata = dict.fromkeys(os.environ)
        self.metadata["command lines"] = "without a salt"
        for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
            with contextlib.suppress(OSError):  # it has ended meanwhile
                if b"a very secret salt" in path.read_bytes():
                    self.metadata["command lines"] = "with the salt"
    def act(self, observation):
        return np.ones((24, 8))
"""


def test_a_policy_gets_no_secrets_but_those_that_are_named(tmp_path, monkeypatch):
    for name in ("OPENAI_API_KEY", "HF_TOKEN", "AWS_ACCESS_KEY_ID", "TOKENIZERS_PARALLELISM"):
        monkeypatch.setenv(name, "secret")
    monkeypatch.setenv(SALT_VARIABLE, "a very secret salt")
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "reader.py").write_text(READER)
    plan = paper_plan("reader:It", 1, policy_env="HF_TOKEN").checked()
    run_plan(plan, tmp_path / "run", paper_runner(plan, tmp_path / "run"), LocalProcesses(1))

    (record,) = read_records(tmp_path / "run")

    assert record.error is None
    assert record.policy_metadata["command lines"] == "without a salt"
    assert {"HF_TOKEN", "TOKENIZERS_PARALLELISM"} <= record.policy_metadata.keys()
    assert {"OPENAI_API_KEY", "AWS_ACCESS_KEY_ID", SALT_VARIABLE}.isdisjoint(record.policy_metadata)
    with pytest.raises(InvalidValueError, match="NOT_SET_HERE is not set here, so policies cannot"):
        paper_plan("reader:It", 1, policy_env="NOT_SET_HERE").checked()


def test_honest_policies_play_alike_beside_a_cheat_in_a_long_folder_with_few_descriptors(
    tmp_path, monkeypatch
):
    folder = tmp_path / ("long" * 40)
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    plan = paper_plan("Dice", 2, policy_process="shared")
    alone = InProcess().run(deque(plan.jobs()), paper_runner(plan, tmp_path))

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = max(map(int, os.listdir("/dev/fd")))  # noqa: PTH208
    resource.setrlimit(resource.RLIMIT_NOFILE, (used + 30, hard))
    try:
        beside = play(tmp_path / "beside", ("Leaker",))["Leaker+1"]
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))

    assert unnamed(beside) == unnamed(alone)


def unnamed(records):
    """Return records without times and the names of their policy, in an order of their own."""
    return sorted((comparable(record) | {"policy": "", "ref": None} for record in records), key=str)


@pytest.fixture(scope="module")
def hosted() -> Iterator[HostedPolicy]:
    """An honest policy in the middle of an episode."""
    with HostPool(HostSettings()) as pool:
        policy = HostedPolicy(pool.connect(), read_policy(HONEST), 3)
        world = PaperWorld(paper_plan("Dice", 1).jobs()[0])
        _, info = world.reset()
        policy.reset("Pick the needle in the haystack.", info["demonstration"])
        policy.act(world.observation())  # type: ignore[arg-type]
        yield policy
        policy.close()


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.usefixtures("hosted")
def test_nobody_can_connect_to_the_supervisor():
    ours = {str(path.readlink()) for path in Path("/proc/self/fd").iterdir() if path.is_socket()}
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        *_, flags, _kind, _state, inode = line.split()[:7]
        assert f"socket:[{inode}]" not in ours or int(flags, 16) == 0, "it listens"
    assert ours


def test_an_episode_begins_where_the_run_began(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with HostPool(HostSettings()) as pool:
        for _ in range(2):  # the first one left for elsewhere
            policy = HostedPolicy(pool.connect(), read_policy(hostile_policies.SPEC("Wanderer")), 0)
            policy.reset("Pick it.", {})
            policy.act({})  # type: ignore[typeddict-item]
            policy.hear("The red one.", 1)
            assert policy.metadata == {"before": str(tmp_path)}
            policy.close()


def test_a_policy_and_files_beside_it_are_imported_only_in_its_own_process(tmp_path, monkeypatch):
    for module in ("json", "multiprocessing", "numpy", "roboirg"):
        (tmp_path / f"{module}.py").write_text(
            f"open('imported {module}', 'w').close()\nraise ImportError('shadowed')\n"
        )
    (tmp_path / "tattler.py").write_text(
        "import os, sys\nimport numpy as np\n"
        "with open('imports', 'a') as file: file.write(f'{sys.orig_argv}\\n')\n"
        "class It:\n    cameras = ()\n    def act(self, o): return np.ones((24, 8))\n"
        "    def reset(self, i, d): self.metadata = {'first': sys.path[0] == os.getcwd()}\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    add_working_directory(last=True)
    run = tmp_path / "run"
    for executor, limit in ((LocalProcesses(1), 99), (InProcess(), 9)):  # versions are compared
        plan = make_plan(["tattler:It"], tasks="PickXtimes", settings="direct", episodes="1",
                         max_steps=limit)  # fmt: skip
        run_plan(plan, run, paper_runner(plan, run), executor)

    imports = (tmp_path / "imports").read_text().splitlines()

    assert len(imports) == 4
    assert all("host_process" in module for module in imports)
    assert not list(tmp_path.glob("imported*"))
    for record in read_records(run):
        assert (record.error, record.policy_metadata) == (None, {"first": True})


def memory_of(pid: int, needle: bytes) -> bool:
    """Return whether the readable memory of a process holds some bytes."""
    with Path(f"/proc/{pid}/mem").open("rb", 0) as memory:
        for line in Path(f"/proc/{pid}/maps").read_text().splitlines():
            found = re.match(r"([0-9a-f]+)-([0-9a-f]+) r", line)
            if found is None or "[vvar]" in line or "[vsyscall]" in line:
                continue
            start = int(found[1], 16)
            end = int(found[2], 16)
            try:
                memory.seek(start)
                content = memory.read(end - start)
            except (OSError, ValueError, OverflowError):
                continue
            if needle in content:
                return True
    return False


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.usefixtures("hosted")
def test_the_memory_of_a_host_holds_no_goal_and_it_has_no_terminal():
    *_, pid = descendants(os.getpid())
    secret = PaperWorld(paper_plan("Dice", 1).jobs()[0]).secret.encode()

    assert memory_of(os.getpid(), secret)  # the search finds what is there
    assert memory_of(pid, b"Pick the needle in the haystack.")
    assert not memory_of(pid, secret)
    assert os.getsid(pid) == pid


def test_a_name_with_lone_surrogates_is_refused():
    with pytest.raises(InvalidValueError, match="name of a policy"):
        make_plan(["x\ud800=random"], tasks="PickXtimes")


class Liar(PaperRunner):
    """Calls a failure a success, as a policy could that patches the judge in its own process."""

    def __call__(self, job: Job) -> Record:
        record = FakePlay()(job)
        return replace(record, outcome="success", cause="picked the wrong cube")


def test_a_success_with_a_cause_is_refused(tmp_path):
    plan: Plan = small_plan(1)
    run_plan(plan, tmp_path, Liar(tmp_path), InProcess())
    for record in read_records(tmp_path):
        assert (record.outcome, record.error, record.goals) == ("error", "policy", None)
        assert record.cause == "policy: a success came with a cause (picked the wrong cube)"

    (honest, *_) = (FakePlay()(job) for job in plan.jobs())
    line = encode(replace(honest, outcome="success", cause="no"))
    with pytest.raises(StoreError, match="a success has no cause, but there is 'no'"):
        read_record(line, tmp_path, 1)


def test_sigterm_is_the_users_where_ctrl_c_is_ignored(monkeypatch):
    """A shell without a terminal starts what is in the background so."""
    monkeypatch.setattr(signal, "getsignal", lambda _number: signal.SIG_IGN)
    with pytest.raises(Terminated), attribute_errors("environment"):
        raise Terminated
    with pytest.raises(EpisodeError), attribute_errors("environment"):
        raise KeyboardInterrupt


def test_in_a_worker_an_interrupt_is_the_policys(tmp_path):
    found = play(tmp_path / "run", ("Interrupter", "Unspeakable"), policy_process="shared")
    for name in ("Interrupter", "Unspeakable"):
        for record in found[hostile_policies.SPEC(name)]:
            assert str(record.cause).startswith(hostile_policies.SPOILED[name])
        assert {record.error for record in found[f"{name}+1"]} == {None}
