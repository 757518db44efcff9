"""A policy that misbehaves in every way costs its own episodes and nothing else."""

from __future__ import annotations

import ctypes
import os
import re
import signal
import time
from collections import Counter, deque
from pathlib import Path
from types import SimpleNamespace

import chaos_policy
import msgspec
import pytest
from evaluation_fakes import FakePlay, WaitingPlay, changed, comparable, small_plan
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from roboirg.core.errors import RoboIRGError
from roboirg.core.waiting import Wait, waiting
from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.play import watchdog
from roboirg.evaluation.play.call_guard import CallGuard, attribute_errors
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.rollout import EpisodeRunner, load_policy
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.records.store import read_records
from roboirg.evaluation.run.executor import LocalProcesses, take_job
from roboirg.evaluation.run.runner import UNREACHABLE_AFTER, RunSummary, run_plan
from roboirg.evaluation.run.workers import Worker
from roboirg.policies.by_name.finding import read_policy

TIMEOUT_S = 20.0


def plan_of_chaos(policy_process: str) -> Plan:
    """Enough episodes for every misdeed to happen, and good ones between them."""
    plan = Plan(
        policies=(chaos_policy.SPEC,),
        tasks=("PickXtimes",),
        settings=("direct",),
        episodes=tuple(range(50)),
        policy_seeds=tuple(range(4)),
        max_steps=15,
        policy_timeout_s=TIMEOUT_S,
        policy_process=policy_process,
        tries=1,
    )
    jobs, chosen, met = plan.jobs(), [], Counter[str | None]()
    for job in jobs:
        misdeed = load_policy(PreparedJob(job)).misdeed  # type: ignore[attr-defined]
        if met[misdeed] < (1 if misdeed else len(chaos_policy.KINDS) // 2):
            met[misdeed] += 1
            chosen.append(job)
    assert set(met) == {None, *chaos_policy.KINDS}

    class Chosen(Plan):
        def jobs(self) -> tuple[Job, ...]:
            return tuple(chosen)

    return Chosen(**dict(plan))


def play(plan: Plan, folder: Path) -> tuple[RunSummary, dict[Job, Record]]:
    player = EpisodeRunner(
        folder, policy_timeout_s=plan.hosting.policy_timeout_s, hosting=plan.hosting.settings
    )
    summary = run_plan(plan, folder, player, LocalProcesses(2, episode_timeout_s=600))
    return summary, {record.identity: record for record in read_records(folder)}


@pytest.fixture(params=["own", pytest.param("shared", marks=pytest.mark.slow)])
def plan(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Plan:
    monkeypatch.syspath_prepend(Path(chaos_policy.__file__).parent)
    return plan_of_chaos(request.param)


@pytest.mark.slow
@pytest.mark.sim
def test_a_policy_of_chaos_costs_its_own_episodes_and_nothing_else(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    summary, wild = play(plan, tmp_path / "wild")
    monkeypatch.setenv(chaos_policy.CALM, "1")
    _, calm = play(plan, tmp_path / "calm")

    assert (summary.missing, summary.total) == (0, len(plan.jobs()))
    assert len(summary.errors) == len(chaos_policy.KINDS)
    for job, record in wild.items():
        misdeed = chaos_policy.misdeed(record.policy_metadata.get("seed", _seed(job)))  # type: ignore[arg-type]
        if misdeed is None:
            assert comparable(record) == comparable(calm[job])
            assert record.usage == {"calls": 3.0}
        else:
            assert (misdeed, record.outcome, record.error) == (
                misdeed,
                "error",
                chaos_policy.KINDS[misdeed],
            )
            assert record.cause is not None
            assert record.cause.startswith(chaos_policy.KINDS[misdeed].replace("_", " ") + ": ")
            assert "\n" not in record.cause
    causes = {misdeed: wild[job].cause for job, misdeed in _misdeeds(plan).items()}
    assert causes["hang"] == "timeout: the policy's act() did not return within 20 s"
    assert causes["hang in reset"] == "timeout: the policy's reset() did not return within 20 s"
    crash = f"policy: the process died of signal {signal.SIGSEGV:d} in the policy's act()"
    assert causes["crash"] == crash
    assert causes["die"] == "policy: the process ended with exit code 0 in the policy's act()"
    assert causes["too much"] == (
        "invalid action: 200000 actions at once are too many; at most 10000."
    )
    assert "1000013 characters of JSON; at most 65536" in str(causes["wordy"])


def _misdeeds(plan: Plan) -> dict[Job, str]:
    jobs = (msgspec.structs.replace(job, ref=None) for job in plan.jobs())  # as records know them
    found = {job: chaos_policy.misdeed(_seed(job)) for job in jobs}
    return {job: misdeed for job, misdeed in found.items() if misdeed is not None}


def _seed(job: Job) -> int:
    job = msgspec.structs.replace(job, ref=read_policy(job.policy))
    return load_policy(PreparedJob(job)).seed  # type: ignore[attr-defined]


def sleepy(job: Job) -> Record:
    time.sleep(3600)
    raise AssertionError(job)


def test_an_episode_that_takes_too_long_is_ended_and_named(tmp_path: Path) -> None:
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


def test_a_crash_in_the_simulators_native_code_is_the_worlds(tmp_path: Path) -> None:
    plan = changed(small_plan(1), settings="direct")
    summary = run_plan(plan, tmp_path, crashing, LocalProcesses(1))
    assert (summary.total, len(summary.errors)) == (1, 1)
    (record,) = read_records(tmp_path)
    # Such a crash may pass, so it was tried again.
    assert (record.error, record.attempt) == ("environment", 2)
    words = f"environment: the process died of signal {signal.SIGSEGV:d} in the environment"
    assert record.cause == words


class Homeless:
    """Cannot be received by another process."""

    def __call__(self, job: Job) -> Record:
        raise AssertionError(job)

    def __reduce__(self) -> tuple[object, ...]:
        return os._exit, (3,)


def test_processes_that_cannot_start_end_the_run(tmp_path: Path) -> None:
    words = r"No worker process can start \(environment: .* exit code 3 in the worker startup\)"
    with pytest.raises(RoboIRGError, match=words):
        run_plan(small_plan(50), tmp_path, Homeless(), LocalProcesses(1))
    assert len(read_records(tmp_path)) < 5


@pytest.mark.slow
def test_a_queue_is_not_the_policys_time_and_a_timeout_says_what_was_waited_for(
    tmp_path: Path,
) -> None:
    plan = changed(small_plan(episodes=2), settings="explicit", tries=1)
    play = WaitingPlay(queued_episode=0, queue_s=7.0, limit_s=5.0)
    run_plan(plan, tmp_path, play, LocalProcesses(1, episode_timeout_s=600))
    queued, stuck = sorted(read_records(tmp_path), key=lambda record: record.episode)
    assert (queued.outcome, queued.error) == ("success", None)
    assert (stuck.outcome, stuck.error) == ("error", "timeout")
    assert stuck.cause == (
        "timeout: the policy's act() did not return within 5 s, waiting for the reply of "
        "openpi://there:8000"
    )


def test_deadlines_stand_still_in_a_queue(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(watchdog, "time", SimpleNamespace(monotonic=lambda: now[0]))
    board = watchdog.Watchdog()
    board.begin_job()
    board.write("policy's reset()", 10.0)
    now[0] += 9
    board.write_wait(Wait("a free server", is_queue=True, since=now[0]))
    now[0] += 1000
    assert not board.is_overdue
    assert (board.queued_s, board.awaited) == (1000.0, "a free server")
    board.write_wait(None)
    assert (board.queued_s, board.awaited, board.is_overdue) == (1000.0, "", False)
    # What is left of the limit is as it was before; a reply counts.
    board.write_wait(Wait("the reply of a server", is_queue=False, since=now[0]))
    now[0] += 0.9
    assert not board.is_overdue
    now[0] += 0.2
    assert board.is_overdue
    assert (board.queued_s, board.awaited) == (1000.0, "the reply of a server")
    board.write("environment")
    board.begin_job()
    assert (board.queued_s, board.awaited, board.is_overdue) == (0.0, "", False)


def test_long_words_for_what_is_waited_for_are_cut() -> None:
    board = watchdog.Watchdog()
    board.write_wait(Wait("é" * 1000, is_queue=False, since=0.0))
    assert board.awaited.startswith("é" * 90)
    assert len(board.awaited.encode()) <= watchdog.MAX_WAIT_LENGTH + 3


def test_time_in_a_queue_has_a_timing_of_its_own() -> None:
    timings: dict[str, float] = {}
    guard = CallGuard(timings, None)
    start = time.perf_counter()
    with guard.policy("policy's reset()", "policy_reset"), waiting("a server", is_queue=True):
        time.sleep(0.3)
    total = time.perf_counter() - start
    assert timings["policy_queue"] >= 0.3
    assert timings["policy_reset"] <= total - 0.3 + 1e-6


def test_an_overdue_worker_is_killed() -> None:
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
        ("environment", TimeoutError("slow"), "environment"),
    ],
)
def test_whose_fault_it_is(whom: str, error: Exception, kind: str) -> None:
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


def test_a_policy_that_cannot_be_reached_is_left_and_the_others_go_on(tmp_path: Path) -> None:
    plan = small_plan(15, ("random", "oracle"))
    summary = run_plan(plan, tmp_path, Unreachable("random"), LocalProcesses(1))
    assert summary.unreachable == ("random",)
    played = len(summary.errors)
    assert UNREACHABLE_AFTER <= played <= UNREACHABLE_AFTER + 1  # one was under way
    assert summary.missing == 30 - played
    assert sum(record.policy == "oracle" for record in read_records(tmp_path)) == 30


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


def test_a_worker_keeps_to_its_scene_and_away_from_those_of_others() -> None:
    jobs = deque(small_plan(3, seeds=2).jobs())
    every = set(jobs)
    played = hand_out(jobs, 2)
    assert [job.episode for job in played] == [0, 1] * 4 + [2] * 4
    assert set(played) == every


@settings(max_examples=25)
@given(st.integers(1, 4), st.integers(1, 3), st.integers(1, 5))
def test_policies_play_one_after_the_other(episodes: int, seeds: int, workers: int) -> None:
    jobs = deque(small_plan(episodes, ("random", "oracle"), seeds).jobs())
    every = list(jobs)
    played = hand_out(jobs, workers)
    assert len(played) == len(every)
    assert set(played) == set(every)
    names = [job.policy for job in played]
    assert names == [job.policy for job in every]


def test_a_retry_waits_for_all_others() -> None:
    first, *others = small_plan(3).jobs()
    assert hand_out(deque([*others, first]), 1) == [*others, first]
    assert hand_out(deque([first, *others]), 1) == [first, *others]
