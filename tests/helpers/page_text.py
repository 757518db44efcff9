"""The page of records that need not be in a folder."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from roboirg.evaluation.analysis.page.report import write_report
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import encode
from roboirg.evaluation.records.store import RECORDS_FILE


def store(folder: Path, records: Sequence[Record], plan: Plan | None = None) -> Source:
    """Write the records of a run, and its plan, and open it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RECORDS_FILE).write_bytes(b"".join(encode(one) + b"\n" for one in records))
    if plan is not None:
        write_plan(plan, folder)
    return Source(folder)


def render(records: Sequence[Record], plan: Plan | None = None) -> str:
    """Return the page of one run."""
    with tempfile.TemporaryDirectory() as folder:
        return write_report(store(Path(folder) / "run", records, plan)).read_text()
