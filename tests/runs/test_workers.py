"""A policy that misbehaves in every way costs its own episodes and nothing else."""

import ctypes
import functools
import itertools
import json
import os
import re
import time
from collections import deque
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from run_fakes import FakePlay, changed, small_plan, starts

from roboirg.core.errors import RoboIRGError
from roboirg.core.waiting import NativeCall, Wait, waiting
from roboirg.records.store import RECORDS_FILE, read_records
from roboirg.runs.episode_errors import EpisodeError
from roboirg.runs.play import watchdog
from roboirg.runs.play.call_guard import CallGuard, attribute_errors
from roboirg.runs.run import workers
from roboirg.runs.run.executor import InProcess, LocalProcesses, take_job
from roboirg.runs.run.runner import run_plan
from roboirg.runs.run.workers import Worker


def sleeps_for_an_hour(job):
    time.sleep(3600)
    raise AssertionError(job)


def test_an_episode_that_takes_too_long_is_ended_and_named(tmp_path):
    """The episode sleeps for an hour, and may take 0.5 s. The worker process may not have got as
    far as the episode by then, so one of two phases is named."""
    plan = changed(small_plan(1), settings="direct")

    run_plan(plan, tmp_path, sleeps_for_an_hour, LocalProcesses(1, episode_timeout_s=0.5))

    (record,) = read_records(tmp_path)
    assert record.error == "timeout"
    assert re.fullmatch(
        r"timeout: the episode took longer than 0\.5 s "
        r"\(now in the (worker startup|environment)\)",
        record.cause,
    )
    assert record.duration_s >= 0.5


def crashes_in_native_code(job):
    ctypes.string_at(0)
    raise AssertionError(job)


def test_a_crash_in_native_code_of_the_simulator_is_an_error_of_the_environment(tmp_path):
    """The process that plays reads from the address 0, which ends it with signal 11. This is no
    error of the policy, which has a process of its own. It may pass, so it was tried again."""
    plan = changed(small_plan(1), settings="direct")

    run_plan(plan, tmp_path, crashes_in_native_code, LocalProcesses(1))

    (record,) = read_records(tmp_path)
    assert (record.error, record.attempt) == ("environment", 2)
    assert record.cause == (
        "environment: the process died of signal 11 (Segmentation fault) in the environment"
    )


def hangs_once_in_native_code(code, load_library, folder, job):
    """Do not return from a call of native code, unless the folder has it that this was tried."""
    with watchdog.watched("policy's reset()"), NativeCall(code):
        if not starts(folder, job):
            FakePlay(folder)(job)
            load_library(None).sleep(3600)
    return FakePlay()(job)


@pytest.mark.parametrize(
    ("code", "load_library"), [("drawing", ctypes.PyDLL), ("physics", ctypes.CDLL)]
)
def test_drawing_or_physics_that_hangs_is_ended_and_the_episode_played_by_another_worker(
    tmp_path, monkeypatch, code, load_library
):
    """When the only episode is played first, a call of a library that is not written in Python does
    not return for an hour, as may happen with a graphics driver. When it is played again, it does.

    A library loaded with PyDLL keeps Python's lock meanwhile, so that no other thread of the
    process can go on; with CDLL it does not. Such calls are given up after 0.5 s here.
    """
    monkeypatch.setattr(watchdog, "NATIVE_LIMIT_S", 0.5)
    plan = changed(small_plan(1), settings="direct")
    play = functools.partial(hangs_once_in_native_code, code, load_library, tmp_path)

    run_plan(plan, tmp_path, play, LocalProcesses(1))

    lost, again = map(json.loads, (tmp_path / RECORDS_FILE).read_text().splitlines())
    assert lost["cause"] == f"environment: the {code} did not return within 0.5 s"
    assert again["outcome"] != "error"
    assert again["attempt"] == 2


class CannotBeUnpickled:
    """Cannot be received by another process."""

    def __call__(self, job):
        raise AssertionError(job)

    def __reduce__(self):
        return os._exit, (3,)


def test_a_run_whose_workers_cannot_start_ends_instead_of_trying_all_episodes(tmp_path):
    """Each worker process exits with code 3 when it receives what is to play. Of 100 episodes fewer
    than five are tried."""
    words = r"No worker process can start \(environment: .* exit code 3 in the worker startup\)"
    with pytest.raises(RoboIRGError, match=words):
        run_plan(small_plan(50), tmp_path, CannotBeUnpickled(), LocalProcesses(1))
    assert len(read_records(tmp_path)) < 5


class Clock:
    """A clock that a test sets, in seconds."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    """The clock of workers and of their watchdogs, as this process sees them."""
    clock = Clock()
    monkeypatch.setattr(watchdog, "time", clock)
    monkeypatch.setattr(workers, "time", clock)
    return clock


@pytest.fixture
def busy_worker(clock):
    """A worker that has begun an episode now and does not end it."""
    worker = Worker(sleeps_for_an_hour, small_plan().jobs()[0])
    yield worker
    worker.child.end()


def test_waiting_in_a_queue_does_not_count_for_the_time_limit_of_a_call(clock):
    """A call may take 10 s. After 9 s it waits 1,000 s for a free server, and then has 1 s left:
    after 0.9 s it may still go on, after 0.2 s more it is overdue."""
    board = watchdog.Watchdog()
    board.write("policy's reset()", 10.0)
    clock.now += 9
    board.write_wait(Wait("a free server", is_queue=True, since=clock.now))

    clock.now += 1000
    assert (board.overdue, board.awaited) == (None, "a free server")

    board.write_wait(None)
    clock.now += 0.9
    assert board.overdue is None
    clock.now += 0.2
    assert board.overdue == ("policy's reset()", 10.0)


def test_waiting_for_a_reply_counts_for_the_time_limit_of_a_call(clock):
    """A call may take 10 s, and waits for the reply of a server, not in a queue. The clock, which
    the fixture replaces, goes on by 10.1 s: the call is overdue."""
    board = watchdog.Watchdog()
    board.write("policy's reset()", 10.0)
    board.write_wait(Wait("the reply of a server", is_queue=False, since=clock.now))

    clock.now += 10.1

    assert board.overdue == ("policy's reset()", 10.0)


def test_waiting_in_a_queue_does_not_count_for_the_time_of_an_episode(clock, busy_worker):
    """A worker plays for 5 s, then its episode waits 1,000 s for a free server: 5 s are spent.

    The clock is replaced by one that the test sets.
    """
    clock.now += 5
    busy_worker.watchdog.write_wait(Wait("a free server", is_queue=True, since=clock.now))

    clock.now += 1000

    assert busy_worker.spent_s == 5.0


def test_the_next_episode_of_a_worker_begins_with_no_time_in_a_queue(clock, busy_worker):
    """The episode before waited 1,000 s for a free server. They are not taken off the time of the
    next one, which would otherwise begin with -1,000 s.

    The clock is replaced by one that the test sets.
    """
    busy_worker.watchdog.write_wait(Wait("a free server", is_queue=True, since=clock.now))
    clock.now += 1000
    busy_worker.watchdog.write_wait(None)

    busy_worker.assign(small_plan().jobs()[1])

    assert busy_worker.spent_s == 0.0


def test_a_call_of_the_policy_is_not_overdue_while_the_simulator_draws(clock):
    """A call of the policy may take 10 s. It reads a picture, which is drawn just then, for 20 s.

    Meanwhile drawing has a limit of its own, and the policy is not blamed. The call is overdue when
    drawing has ended (0) and it still goes on. The clock is replaced by one that the test sets.
    """
    board = watchdog.Watchdog()
    board.write("policy's reset()", 10.0)

    board.write_native("drawing", clock.now)
    clock.now += 20
    assert (board.phase, board.overdue) == ("drawing", None)

    board.write_native("drawing", 0.0)
    assert (board.phase, board.overdue) == ("policy's reset()", ("policy's reset()", 10.0))


def test_drawing_has_a_time_limit_of_its_own_120_s(clock):
    """Drawing goes on for 121 s, by a clock that the test sets."""
    board = watchdog.Watchdog()

    board.write_native("drawing", clock.now)
    clock.now += 121

    assert board.overdue == ("drawing", 120.0)


def test_a_record_has_the_time_in_a_queue_apart_from_the_time_of_the_call():
    """A call of the policy waits 0.3 s for a server that others use. Earlier calls of the episode
    waited 5 s, so the sum is at least 5.3 s. The time of the call is what is left of the whole time
    without these 0.3 s; a microsecond allows for rounding."""
    timings = {"policy_queue": 5.0}
    guard = CallGuard(timings, None)

    start = time.perf_counter()
    with guard.policy("policy's reset()", "policy_reset"), waiting("a server", is_queue=True):
        time.sleep(0.3)
    total = time.perf_counter() - start

    assert timings["policy_queue"] >= 5.3
    assert timings["policy_reset"] <= total - 0.3 + 1e-6


@pytest.mark.parametrize(
    ("whom", "error", "kind"),
    [
        ("policy", ConnectionRefusedError("refused"), "connection"),
        ("policy", TimeoutError("slow"), "timeout"),
        ("policy", OSError("odd"), "policy"),
        ("policy", SystemExit(), "policy"),
        ("environment", TimeoutError("slow"), "environment"),
    ],
)
def test_an_exception_is_an_error_of_the_policy_the_environment_or_the_connection(
    whom, error, kind
):
    with pytest.raises(EpisodeError) as caught, attribute_errors(whom):
        raise error

    assert caught.value.kind == kind


class WithoutConnection:
    """Every episode of one policy ends without a connection."""

    def __init__(self, policy):
        self.policy = policy

    def __call__(self, job):
        record = FakePlay()(job)
        if job.policy != self.policy:
            return record
        lost = {"outcome": "error", "error": "connection", "cause": "connection: refused"}
        return replace(record, **lost)


def test_a_policy_that_cannot_be_connected_to_is_given_up_and_the_others_are_played(tmp_path):
    """Two policies play 30 episodes each; to `random` no connection can be made.

    It is given up after 20 errors; one more episode may be under way then. All of the other are
    played.
    """
    plan = small_plan(15, ("random", "oracle"))

    summary = run_plan(plan, tmp_path, WithoutConnection("random"), InProcess())

    assert summary.unreachable == ("random",)
    assert 20 <= len(summary.errors) <= 20 + 1
    assert sum(record.policy == "oracle" for record in read_records(tmp_path)) == 30


def test_a_policy_with_every_other_connection_refused_is_not_given_up(tmp_path):
    """A server that drops every other connection is slow, not gone. Of 40 episodes 20 fail at
    first, as many as would be too many in a row; none is missing in the end."""
    turns = itertools.cycle((WithoutConnection("random"), FakePlay()))

    def play(job):
        return next(turns)(job)

    summary = run_plan(small_plan(20), tmp_path, play, InProcess())

    assert (summary.unreachable, summary.missing) == ((), 0)


def order_for_workers(jobs, workers):
    """Return the jobs in the order in which workers that take turns get them."""
    active = []
    played = []
    while jobs:
        others = active
        if len(active) == workers:
            others = active[1:]  # the first has finished
        job = take_job(jobs, others)
        active = [*others, SimpleNamespace(job=job)]
        played.append(job)
    return played


def test_a_worker_plays_all_episodes_of_its_scene_before_it_takes_another():
    """Two workers by turns, three scenes with two settings and two seeds each.

    A scene is built once by its worker; would find two workers that build the same one.
    """
    jobs = deque(small_plan(episodes=3, seeds=2).jobs())

    played = order_for_workers(jobs, workers=2)

    assert [job.episode for job in played] == [0, 1, 0, 1, 0, 1, 0, 1, 2, 2, 2, 2]


@settings(max_examples=25)
@given(episodes=st.integers(1, 4), seeds=st.integers(1, 3), workers=st.integers(1, 5))
def test_all_episodes_of_a_policy_are_played_before_those_of_the_next(episodes, seeds, workers):
    """So that only one model is in memory at a time. A plan lists its jobs policy by policy;
    workers, however many, take them so that policies are played in the same order, and each job
    once."""
    jobs = small_plan(episodes, ("random", "oracle"), seeds).jobs()

    played = order_for_workers(deque(jobs), workers)

    assert [job.policy for job in played] == [job.policy for job in jobs]
    assert set(played) == set(jobs)
