"""A policy that misbehaves in every way costs its own episodes and nothing else."""

from __future__ import annotations

import ctypes
import functools
import itertools
import json
import os
import re
import signal
import time
from collections import deque
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from run_fakes import FakePlay, changed, small_plan, starts

from roboirg.core.errors import RoboIRGError
from roboirg.core.waiting import NativeCall, NativeCode, Wait, waiting
from roboirg.records.record import Job, Record
from roboirg.records.store import RECORDS_FILE, read_records
from roboirg.runs.episode_errors import EpisodeError
from roboirg.runs.play import watchdog
from roboirg.runs.play.call_guard import CallGuard, attribute_errors
from roboirg.runs.run.executor import InProcess, LocalProcesses, take_job
from roboirg.runs.run.runner import UNREACHABLE_AFTER, run_plan
from roboirg.runs.run.workers import Worker


def sleepy(job: Job) -> Record:
    time.sleep(3600)
    raise AssertionError(job)


def test_an_episode_that_takes_too_long_is_ended_and_named(tmp_path):
    plan = changed(small_plan(1), settings="direct")
    run_plan(plan, tmp_path, sleepy, LocalProcesses(1, episode_timeout_s=0.5))
    (record,) = read_records(tmp_path)
    assert record.error == "timeout"

    # The process may not have got as far as the episode.
    phase = "(worker startup|environment)"
    words = rf"timeout: the episode took longer than 0\.5 s \(now in the {phase}\)"
    assert re.fullmatch(words, str(record.cause))
    assert record.duration_s >= 0.5


def crashing(job: Job) -> Record:
    ctypes.string_at(0)
    raise AssertionError(job)


def test_a_crash_in_the_simulators_native_code_is_the_worlds(tmp_path):
    plan = changed(small_plan(1), settings="direct")
    summary = run_plan(plan, tmp_path, crashing, LocalProcesses(1))
    assert (summary.total, len(summary.errors)) == (1, 1)

    (record,) = read_records(tmp_path)
    # Such a crash may pass, so it was tried again.
    assert (record.error, record.attempt) == ("environment", 2)

    words = "environment: the process died of signal 11 (Segmentation fault) in the environment"
    assert record.cause == words


def hanging(code: NativeCode, load_library: type[ctypes.CDLL], folder: Path, job: Job) -> Record:
    """At first never return from native code, which may keep Python's lock; then play."""
    with watchdog.watched("policy's reset()"), NativeCall(code):
        if not starts(folder, job):
            FakePlay(folder)(job)
            load_library(None).sleep(3600)
    return FakePlay()(job)


@pytest.mark.parametrize(
    ("code", "load_library"), [("drawing", ctypes.PyDLL), ("physics", ctypes.CDLL)]
)
def test_native_code_that_hangs_is_the_worlds_and_played_again_by_another(
    tmp_path, monkeypatch, code, load_library
):
    monkeypatch.setattr(watchdog, "NATIVE_LIMIT_S", 0.5)
    play = functools.partial(hanging, code, load_library, tmp_path)
    run_plan(changed(small_plan(1), settings="direct"), tmp_path, play, LocalProcesses(1))

    lost, again = map(json.loads, (tmp_path / RECORDS_FILE).read_text().splitlines())

    assert lost["cause"] == f"environment: the {code} did not return within 0.5 s"
    assert (again["outcome"] != "error", again["attempt"]) == (True, 2)


class Homeless:
    """Cannot be received by another process."""

    def __call__(self, job: Job) -> Record:
        raise AssertionError(job)

    def __reduce__(self) -> tuple[object, ...]:
        return os._exit, (3,)


def test_processes_that_cannot_start_end_the_run(tmp_path):
    words = r"No worker process can start \(environment: .* exit code 3 in the worker startup\)"
    with pytest.raises(RoboIRGError, match=words):
        run_plan(small_plan(50), tmp_path, Homeless(), LocalProcesses(1))
    assert len(read_records(tmp_path)) < 5


def test_deadlines_stand_still_in_a_queue(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(watchdog, "time", SimpleNamespace(monotonic=lambda: now[0]))
    board = watchdog.Watchdog()
    job = small_plan().jobs()[0]
    worker = object.__new__(Worker)
    worker.watchdog, worker.child = board, SimpleNamespace(send=str)  # type: ignore[assignment]
    worker.assign(job)
    board.write("policy's reset()", 10.0)
    now[0] += 9
    board.write_wait(Wait("a free server", is_queue=True, since=now[0]))
    now[0] += 1000

    # The queue's time is taken off.
    assert (board.overdue, board.awaited, worker.spent_s < 0) == (None, "a free server", True)

    board.write_wait(None)
    # What is left of the limit is as it was before; a reply counts.
    board.write_wait(Wait("the reply of a server", is_queue=False, since=now[0]))
    now[0] += 0.9
    assert board.overdue is None

    now[0] += 0.2
    assert board.overdue == ("policy's reset()", 10.0)

    board.write("environment")
    worker.assign(job)
    assert (board.queued_s, board.awaited, board.overdue) == (0.0, "", None)


def test_a_policy_is_not_late_while_the_world_draws():
    """A built-in policy and a client draw the video in the policy's own time."""
    board = watchdog.Watchdog()
    board.write("policy's reset()", 1e-9)
    board.write_native("drawing", time.monotonic())
    assert (board.phase, board.overdue) == ("drawing", None)

    board.write_native("drawing", time.monotonic() - 121)
    assert board.overdue == ("drawing", 120.0)

    board.write_native("drawing", 0.0)
    assert (board.phase, board.overdue) == ("policy's reset()", ("policy's reset()", 1e-9))


def test_time_in_a_queue_has_a_timing_of_its_own():
    timings = {"policy_queue": 5.0}  # of earlier calls
    guard = CallGuard(timings, None)
    start = time.perf_counter()
    with guard.policy("policy's reset()", "policy_reset"), waiting("a server", is_queue=True):
        time.sleep(0.3)

    total = time.perf_counter() - start

    assert timings["policy_queue"] >= 5.3
    assert timings["policy_reset"] <= total - 0.3 + 1e-6


def test_an_overdue_worker_is_killed():
    worker = Worker(sleepy, small_plan(1).jobs()[0])
    assert worker.poll(3600) is None

    record = worker.poll(0.0)
    assert record is not None
    assert worker.is_dead
    assert worker.child.exit == (-signal.SIGKILL,)


@pytest.mark.parametrize(
    ("whom", "error", "kind"),
    [
        ("policy", ConnectionRefusedError("refused"), "connection"),
        ("policy", TimeoutError("slow"), "timeout"),
        ("policy", OSError("odd"), "policy"),
        ("policy", GeneratorExit(), "policy"),
        ("policy", SystemExit(), "policy"),
        ("environment", TimeoutError("slow"), "environment"),
    ],
)
def test_an_error_has_the_kind_of_who_raised_it(whom, error, kind):
    with pytest.raises(EpisodeError) as caught, attribute_errors(whom):  # type: ignore[arg-type]
        raise error
    assert caught.value.kind == kind


class Unreachable:
    """Every episode of one policy ends without a connection."""

    def __init__(self, policy: str) -> None:
        self.policy = policy

    def __call__(self, job: Job) -> Record:
        record = FakePlay()(job)
        if job.policy != self.policy:
            return record
        lost = {"outcome": "error", "error": "connection", "cause": "connection: refused"}
        return replace(record, **lost)


def test_a_policy_that_cannot_be_reached_is_left_and_the_others_go_on(tmp_path):
    plan = small_plan(15, ("random", "oracle"))
    summary = run_plan(plan, tmp_path, Unreachable("random"), InProcess())
    assert summary.unreachable == ("random",)

    played = len(summary.errors)
    assert UNREACHABLE_AFTER <= played <= UNREACHABLE_AFTER + 1  # one was under way
    assert summary.missing == 30 - played
    assert sum(record.policy == "oracle" for record in read_records(tmp_path)) == 30


def test_connection_errors_that_are_not_in_a_row_leave_no_policy(tmp_path):
    """A server that drops every other connection is slow, not gone."""
    turns = itertools.cycle((Unreachable("random"), FakePlay()))

    def play(job: Job) -> Record:
        return next(turns)(job)

    summary = run_plan(small_plan(UNREACHABLE_AFTER), tmp_path, play, InProcess())

    assert (summary.unreachable, summary.missing) == ((), 0)


def hand_out(jobs: deque[Job], workers: int) -> list[Job]:
    """Return the jobs as workers that take turns get them."""
    active: list[SimpleNamespace] = []
    played = []
    while jobs:
        if len(active) < workers:
            job = take_job(jobs, active)  # type: ignore[arg-type]
            active.append(SimpleNamespace(job=job))
        else:
            active.append(active.pop(0))
            active[-1].job = job = take_job(jobs, active[:-1])  # type: ignore[arg-type]
        played.append(job)
    return played


def test_a_worker_keeps_to_its_scene_and_away_from_those_of_others():
    jobs = deque(small_plan(3, seeds=2).jobs())
    every = set(jobs)

    played = hand_out(jobs, 2)

    assert [job.episode for job in played] == [0, 1] * 4 + [2] * 4
    assert set(played) == every


@settings(max_examples=25)
@given(st.integers(1, 4), st.integers(1, 3), st.integers(1, 5))
def test_policies_play_one_after_the_other(episodes, seeds, workers):
    jobs = deque(small_plan(episodes, ("random", "oracle"), seeds).jobs())
    every = list(jobs)
    played = hand_out(jobs, workers)
    assert len(played) == len(every)
    assert set(played) == set(every)

    names = [job.policy for job in played]
    assert names == [job.policy for job in every]
