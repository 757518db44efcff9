"""Hooks get every record and can do a run no harm."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from evaluation_fakes import FakePlay, small_plan
from msgspec.structs import replace

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import encode
from roboirg.evaluation.records.store import read_records
from roboirg.evaluation.run import record_hook
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.progress import Reporter
from roboirg.evaluation.run.record_hook import CommandHook, HookedReporter, RecordFunction
from roboirg.evaluation.run.runner import RunSummary, run_plan


class Listening(Reporter):
    def __init__(self) -> None:
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        self.warnings.append(text)


def play(folder: Path, hook: RecordFunction, episodes: int = 3) -> tuple[RunSummary, list[str]]:
    reporter = Listening()
    with HookedReporter(reporter, hook) as hooked:
        summary = run_plan(small_plan(episodes), folder, FakePlay(), InProcess(), reporter=hooked)
    return summary, reporter.warnings


def command(code: str) -> str:
    return f'"{sys.executable}" -c "{code}"'


def test_a_command_gets_each_record_as_a_line(tmp_path: Path) -> None:
    out = tmp_path / "seen.jsonl"
    copy = f"import sys; open('{out}', 'w').write(sys.stdin.read())"
    summary, warnings = play(tmp_path / "run", CommandHook(command(copy)))
    stored = read_records(tmp_path / "run")
    assert [json.loads(line) for line in out.read_text().splitlines()] == [
        json.loads(encode(one)) for one in stored
    ]
    assert len(stored) == summary.total
    assert warnings == []


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import sys; sys.exit(3)", "exit code 3|ended before the run"),
        ("import sys; sys.stdin.readline(); sys.exit(4)", "exit code 4|ended before the run"),
    ],
)
def test_a_command_that_fails_is_told_once_and_harms_nothing(
    tmp_path: Path, code: str, words: str
) -> None:
    summary, warnings = play(tmp_path, CommandHook(command(code)), episodes=30)
    assert len(read_records(tmp_path)) == summary.total == summary.played
    assert len(warnings) == 1
    assert any(word in warnings[0] for word in words.split("|"))
    assert "All records are stored" in warnings[0]


def test_a_command_that_reads_nothing_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(record_hook, "MOST_WAITING", 2)
    monkeypatch.setattr(record_hook, "CLOSE_S", 0.5)
    big = 1 << 17  # more than a pipe holds
    plan = small_plan(30)
    hook = CommandHook(command("import time; time.sleep(600)"))
    reporter = Listening()

    def play_job(job: object) -> Record:
        record = FakePlay()(job)  # type: ignore[arg-type]
        return replace(record, details="x" * big)

    with HookedReporter(reporter, hook) as hooked:
        summary = run_plan(plan, tmp_path, play_job, InProcess(), reporter=hooked)
    assert summary.played == summary.total
    assert len(reporter.warnings) == 1
    assert "has not read 2 records" in reporter.warnings[0]
    assert hook._process.poll() is not None


def test_a_function_that_raises_is_called_no_more(tmp_path: Path) -> None:
    seen: list[Record] = []

    def hook(record: Record) -> None:
        seen.append(record)
        if len(seen) == 2:
            raise KeyError("no run")

    summary, warnings = play(tmp_path, hook)
    assert len(seen) == 2
    assert summary.played == summary.total > 2
    assert [("KeyError" in one, "no more records of this run" in one) for one in warnings] == [
        (True, True)
    ]


@pytest.mark.parametrize("text", ["", "no-such-program-here --x", "python 'open"])
def test_a_command_that_cannot_start_is_one_sentence(text: str) -> None:
    with pytest.raises(InvalidValueError, match=r"^(--on-record|The command) "):
        CommandHook(text)
