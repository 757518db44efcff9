"""Records of policies that listen and forget, runs of them, what commands print, and the page."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from made_records import make_record
from msgspec.structs import replace
from typer.testing import CliRunner

from roboirg.analysis.page.report import write_report
from roboirg.analysis.results.sources import Source
from roboirg.core.failures import FAILURES
from roboirg.main import app
from roboirg.records.record import Attribution, EventRecord, Record
from roboirg.records.record_codec import encode
from roboirg.records.store import RECORDS_FILE
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.stored_plans import write_plan

PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask", "StopCube"),
    episodes=(0, 1, 2),
    forms=("implicit", "resolved"),
)
MISSES = [(meaning.kind, failure) for failure, meaning in FAILURES.items()]


def played(plan: Plan) -> list[Record]:
    """Return the records of a plan: the forgetful policy fails where it must remember."""
    found = []
    for number, job in enumerate(plan.jobs()):
        lost = job.policy == "forgetful" and job.form == "implicit" and job.setting != "explicit"
        outcome = ("failure", "picked up the wrong cube") if lost else ("success",)
        record = make_record(job, *outcome, steps=80, started_at="2026-01-02T03:04:05+00:00")
        subject = f"cube_{record.goal.get('color', 'red')}"
        events = (
            EventRecord(step=-20, kind="still", subject="robot"),
            EventRecord(step=-10, kind="over", subject=subject, place="target"),
            EventRecord(step=40, kind="picked", subject=subject),
            EventRecord(step=60, kind="picked", subject=subject, holds=False),
            EventRecord(step=60, kind="placed", subject=subject, place="target"),
            EventRecord(step=70, kind="placed", subject=subject, place="target", holds=False),
        )
        kind, failure = MISSES[number % len(MISSES)]
        wrong = Attribution(
            kind=kind, failure=failure, subject=subject, step=60, sentence="The wrong cube."
        )
        course = {"events": events, "attribution": wrong if lost else None}
        found.append(replace(record, demonstration_steps=20, package_version="0", **course))
    return found


def broken(record: Record) -> Record:
    """Return it as that of a policy that raised an error with markup in its text."""
    cause = "policy: ValueError: </script><b>&"
    details = "Traceback <script>alert(1)</script>"
    error = {"outcome": "error", "error": "policy", "cause": cause, "details": details}
    return replace(record, attribution=None, **error)


def store(folder: Path, records: Sequence[Record], plan: Plan | None = None) -> Source:
    """Write the records of a run, and its plan, and open it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RECORDS_FILE).write_bytes(b"".join(encode(record) + b"\n" for record in records))
    if plan is not None:
        write_plan(plan, folder)
    return Source(folder)


def render(records: Sequence[Record], plan: Plan | None = None) -> str:
    """Return the page of one run."""
    with tempfile.TemporaryDirectory() as folder:
        return write_report(store(Path(folder) / "run", records, plan)).read_text()


def call(*words: object) -> str:
    """Return what a command prints, which must succeed; errors are raised."""
    outcome = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def words(text: str) -> str:
    """Return the lines of a text that are not blank, with single spaces."""
    lines = [" ".join(line.split()) for line in text.splitlines()]
    return "\n".join([*filter(None, lines), ""])
