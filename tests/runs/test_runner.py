"""Real processes, real signals."""

import dataclasses
import signal
import subprocess
import sys
import time
from unittest import mock

import pytest
import run_fakes
from made_records import fill
from msgspec.structs import replace
from run_fakes import (
    FakePlay,
    all_comparable,
    changed,
    fake_run,
    is_alive,
    line_count,
    small_plan,
    worker_pids,
)

from roboirg.core.errors import InvalidValueError, RenderDeviceError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import unknown_policy
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record_codec import StoreError
from roboirg.records.run_files import earlier_plans
from roboirg.records.store import (
    RECORDS_FILE,
    read_records,
)
from roboirg.runs.plan.stored_plans import read_plan, read_plans
from roboirg.runs.play import episode_record
from roboirg.runs.run.executor import InProcess, LocalProcesses, choose_executor
from roboirg.runs.run.progress import Reporter
from roboirg.runs.run.ray_machines import MachineVersions
from roboirg.runs.run.runner import run_plan

WAIT_S = 300.0
OTHER_WORDS = "PickXtimes/test@0a0a0a0a0a0a"


def wait_until(condition):
    deadline = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < deadline, "it takes too long"
        time.sleep(0.02)


def begun_run(folder, workers=1):
    """Start the run of `run_fakes`, 16 episodes, in a process; return when three have ended."""
    child = subprocess.Popen([sys.executable, run_fakes.__file__, folder, str(workers)])
    wait_until(lambda: line_count(folder) >= 3 or child.poll() is not None)
    assert child.poll() is None
    return child


def finish_run(folder):
    """Play what is missing of the run of `run_fakes`."""
    return fake_run(folder, small_plan(8))


@pytest.fixture(scope="module")
def records_of_an_uninterrupted_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("uninterrupted")
    fake_run(folder, small_plan(8))
    return all_comparable(folder)


def test_a_killed_run_goes_on_with_the_same_command_and_has_the_same_records_in_the_end(
    tmp_path, records_of_an_uninterrupted_run
):
    """A run of 16 episodes with two workers is killed after at least three; when the workers have
    ended, too, the same command plays the rest. The records are those of a run that nobody killed.
    """
    child = begun_run(tmp_path, workers=2)
    child.send_signal(signal.SIGKILL)
    child.wait()
    wait_until(lambda: not any(map(is_alive, worker_pids(tmp_path))))
    stored = len(read_records(tmp_path))

    summary = finish_run(tmp_path)

    assert 3 <= stored < 16
    assert summary.played == 16 - stored
    assert all_comparable(tmp_path) == records_of_an_uninterrupted_run


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_or_sigterm_ends_the_workers_and_keeps_the_records_of_ended_episodes(
    tmp_path, number, records_of_an_uninterrupted_run
):
    """A run of 16 episodes in a process of its own gets a signal after at least three.

    No worker stays alive, and the same command then plays the rest with the same records in the
    end.
    """
    child = begun_run(tmp_path)

    child.send_signal(number)

    assert child.wait(WAIT_S) != 0
    assert not any(map(is_alive, worker_pids(tmp_path)))
    assert 3 <= len(read_records(tmp_path)) < 16
    finish_run(tmp_path)
    assert all_comparable(tmp_path) == records_of_an_uninterrupted_run


def test_an_episode_in_which_the_worker_dies_twice_is_one_error_and_the_rest_is_played(tmp_path):
    """Of four episodes the one with number 2 kills its worker process each time. That may be bad
    luck, so it is tried twice; then it is an error of its own kind, which is not the policy's."""
    plan = changed(small_plan(4), settings="direct")

    summary = run_plan(plan, tmp_path, FakePlay(tmp_path, deadly=2), LocalProcesses(1))

    assert (summary.played, summary.missing) == (4, 0)
    (error,) = (record for record in read_records(tmp_path) if record.outcome == "error")
    assert (error.episode, error.error, error.attempt) == (2, "infrastructure", 2)
    assert error.cause == "infrastructure: the process died of signal 9 (Killed) in the environment"


def run_with_one_error(folder):
    """Play four episodes, of which number 2 is an error after two attempts; return their plan."""
    plan = changed(small_plan(4), settings="direct")

    def fail_episode_2(job):
        record = FakePlay()(job)
        if job.episode != 2:
            return record
        return replace(record, outcome="error", error="environment", cause="environment: x")

    run_plan(plan, folder, fail_episode_2, InProcess())
    return plan


def test_the_same_command_plays_errors_again(tmp_path):
    """A run has played four episodes, of which one ended in an error in each of two attempts.

    The same plan plays this one again: the third attempt is no error, so that nothing is left to
    play the next time. The folder has no earlier plan, as it was the same one each time.
    """
    plan = run_with_one_error(tmp_path)

    second_run = fake_run(tmp_path, plan)
    third_run = fake_run(tmp_path, plan)

    assert (second_run.played, third_run.played) == (1, 0)
    assert sorted(record.attempt for record in read_records(tmp_path)) == [1, 1, 1, 3]
    assert not earlier_plans(tmp_path)


def test_errors_are_not_played_again_if_asked_not_to(tmp_path):
    """A run has played four episodes, of which one ended in an error."""
    plan = run_with_one_error(tmp_path)

    summary = fake_run(tmp_path, plan, retry_errors=False)

    assert (summary.played, len(summary.errors)) == (0, 1)


def test_missing_graphics_stop_the_run_and_the_records_before_are_kept(tmp_path):
    """Of four episodes, numbers 0 to 3, the third finds no graphics, which no other one would."""
    with pytest.raises(RenderDeviceError, match="No Vulkan device can render; install one"):
        run_plan(small_plan(4), tmp_path, FakePlay(fatal=2), LocalProcesses(1))

    assert {record.episode for record in read_records(tmp_path)} == {0, 1}


def test_a_run_may_be_repeated_with_more_episodes_in_its_folder(tmp_path):
    """Each episode is told in two settings. A run of 2 episodes has 4 results; then 4 are asked
    for, which are 8 results, of which 4 are new."""
    fake_run(tmp_path, small_plan(episodes=2))

    more = fake_run(tmp_path, small_plan(episodes=4))

    assert (more.played, more.total) == (4, 8)


def test_what_a_repeated_run_with_fewer_episodes_leaves_out_is_kept_and_not_missing(tmp_path):
    """Four episodes are played in two settings each, which makes 8 records. Then one is asked for,
    of which both records are there, so nothing is played. The stored plan is the last one."""
    fake_run(tmp_path, small_plan(episodes=4))

    fewer = fake_run(tmp_path, small_plan(episodes=1))

    assert (fewer.played, fewer.total, fewer.missing) == (0, 2, 0)
    assert len(read_records(tmp_path)) == 8
    assert list(read_plans(tmp_path)) == [small_plan(1)]


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        (
            "seed",
            7,
            r"PickXtimes test/0 whose scene seed is 7, but in .* it is \d+; choose another",
        ),
        ("episode", 99, r"PickXtimes test/99 whose scene seed is \d+, but in .* it is none;"),
        (
            "environment_version",
            99,
            "whose environment version is 99, but in this roboirg it is 1;",
        ),
        ("language_version", "99.0", r"language version is 99\.0, but in this roboirg it is \d"),
        ("task", "Gone", "whose words version is .*, but in this roboirg it is Gone/test@none;"),
        ("words", OTHER_WORDS, f"version is {OTHER_WORDS}, but in this roboirg it is Pick"),
        (
            "ref",
            dataclasses.replace(read_policy("random"), version="old"),
            "random whose policy version is old, but now it is built-in",
        ),
    ],
)
def test_a_run_does_not_go_on_in_a_folder_with_results_of_other_scenes_words_or_versions(
    tmp_path, name, value, sentence
):
    """The folder holds two records. In the second one a field differs from what would be played
    now: a seed or a task that is not there, a version, or what the policy is (its `ref`).

    The first fits, and ended in an error, which would be played again: all records have to be
    compared before. Nothing is played, and no plan is written.
    """
    played, other = map(FakePlay(), small_plan(1).jobs())
    fitting_error = replace(other, outcome="error", error="connection", cause="connection: x")
    fill(tmp_path, fitting_error, replace(played, **{name: value}))

    with pytest.raises(StoreError, match=sentence):
        fake_run(tmp_path, small_plan(2))

    assert len(read_records(tmp_path)) == 2
    assert read_plan(tmp_path) is None


def test_a_line_that_was_cut_off_is_reported_before_an_episode_is_played(tmp_path):
    """The cut line has 22 bytes. One warning comes first, then the progress of two episodes.

    The reporter, which would print both, is replaced by one that notes how it is called.
    """
    (tmp_path / RECORDS_FILE).write_bytes(b'{"policy":"random","ta')
    reporter = mock.Mock(spec=Reporter)

    fake_run(tmp_path, small_plan(1), reporter=reporter)

    calls = [name for name, *_ in reporter.method_calls if name in ("warn", "advance")]
    assert calls == ["warn", "advance", "advance"]
    assert "(22 bytes) to" in reporter.warn.call_args.args[0]


@pytest.mark.parametrize(
    ("trained", "warned"),
    [
        (None, []),
        (("PickXtimes", "BinFill"), []),
        (
            ("BinFill",),
            ["random plays PickXtimes, which it was not trained on: it was trained on BinFill."],
        ),
    ],
)
def test_a_run_warns_once_of_a_task_on_which_the_policy_was_not_trained(tmp_path, trained, warned):
    """The policy says that it was trained on the tasks `trained`; None says nothing. It plays two
    episodes of PickXtimes. The reporter, which would print a warning, is replaced by one that notes
    how it is called."""
    policy = dataclasses.replace(read_policy("random"), needs=PolicyNeeds(trained_tasks=trained))
    reporter = mock.Mock(spec=Reporter)

    fake_run(tmp_path, changed(small_plan(2), policies=(policy,)), reporter=reporter)

    assert [warning.args[0] for warning in reporter.warn.call_args_list] == warned


@pytest.mark.parametrize(
    ("workers", "executor"),
    [(None, LocalProcesses(5)), (0, InProcess()), (3, LocalProcesses(3))],
)
def test_the_number_of_workers_chooses_the_executor(monkeypatch, workers, executor):
    """If it is not given, a variable of the environment says it."""
    monkeypatch.setenv("ROBOIRG_WORKERS", "5")

    assert choose_executor(workers) == executor


def test_a_negative_number_of_workers_is_refused():
    with pytest.raises(InvalidValueError, match="workers is -1"):
        choose_executor(-1)


@pytest.mark.parametrize(
    ("field", "value", "what"),
    [("environment_version", 7, "environment"), ("words", OTHER_WORDS, "words")],
)
def test_a_record_that_a_worker_of_another_version_made_is_not_stored(tmp_path, field, value, what):
    """What plays returns a record that differs in one field, as if a worker on another machine had
    another version of this package. The run ends with an error, and the file of records is empty.
    """

    def play_elsewhere(job):
        return replace(FakePlay()(job), **{field: value})

    with pytest.raises(StoreError, match=f"whose {what} version is {value}, .* was not stored"):
        run_plan(small_plan(1).checked(), tmp_path, play_elsewhere, InProcess())

    assert (tmp_path / RECORDS_FILE).read_bytes() == b""


@pytest.fixture
def fingerprints_of_package(tmp_path, monkeypatch):
    """Return what computes the fingerprints of the package that is in this folder."""
    module = tmp_path / "roboirg" / "runs" / "play" / "episode_record.py"
    monkeypatch.setattr(episode_record, "__file__", str(module))
    return episode_record.code_fingerprints.__wrapped__  # which keeps no values


@pytest.mark.parametrize(
    ("name", "is_code", "decides_verdicts"),
    [
        ("cli/a.py", True, False),
        ("language/words.toml", True, True),
        ("core/version.py", True, False),
        ("tasks/__pycache__/a.pyc", False, False),
    ],
)
def test_a_changed_file_changes_the_fingerprint_of_the_code_and_that_of_verdicts_if_it_matters(
    tmp_path, fingerprints_of_package, name, is_code, decides_verdicts
):
    """A record has two checksums of the code that made it: of all, and of what decides verdicts.

    The package has one file, which is changed. Commands (cli) and the number of the release cannot
    change a verdict, words can; caches of the interpreter are no code. `fingerprints_of_package`
    computes both for the package that is in the folder of the test.
    """
    file = tmp_path / "roboirg" / name
    file.parent.mkdir(parents=True)

    file.write_text("before")
    code, verdict_code = fingerprints_of_package()
    file.write_text("after")
    new_code, new_verdict_code = fingerprints_of_package()

    assert (new_code != code) == is_code
    assert (new_verdict_code != verdict_code) == decides_verdicts


@pytest.mark.parametrize(("error", "place"), [("infrastructure", 1), ("environment", -1)])
def test_an_episode_that_lost_its_process_is_repeated_at_once_and_one_with_an_error_last(
    tmp_path, error, place
):
    """The first of eight episodes ends in an error. If its process was lost (infrastructure), it is
    played again as the second one, at place 1; if the environment failed, after all others, at the
    last place (-1)."""
    played = []

    def fail_the_first(job):
        played.append(job.slug)
        record = FakePlay()(job)
        if len(played) == 1:
            return replace(record, outcome="error", error=error, cause=f"{error}: x")
        return record

    run_plan(small_plan(4), tmp_path, fail_the_first, InProcess())

    assert played[place] == played[0]


def test_a_machine_with_another_package_version_is_refused():
    """Machines of a cluster compare what they have; this one has the same but for version 9."""
    here = MachineVersions((read_policy("random"),))
    there = dataclasses.replace(here, installed=here.installed._replace(package_version="9"))

    version = here.installed.package_version
    assert here.difference(there) == f"the package version is 9 there and {version} here"


def test_a_machine_with_another_version_of_a_policy_is_refused_by_its_name():
    """Machines of a cluster compare what they have, here the policy `random` in two versions."""
    random = read_policy("random")
    here = MachineVersions((random,))
    there = MachineVersions((dataclasses.replace(random, version="old"),))

    assert here.difference(there).startswith("the policy version of random is old there")


def test_policies_of_an_unknown_version_are_not_compared_between_machines():
    """The first policy of a plan is of an unknown version here, the second one is the same."""
    random = read_policy("random")
    here = MachineVersions((unknown_policy("x"), random))
    there = MachineVersions((read_policy("oracle"), random))

    assert here.difference(there) is None
