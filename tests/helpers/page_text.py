"""The page of records that need not be in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from roboirg.evaluation.analysis.page.entries import Run
from roboirg.evaluation.analysis.page.report import render_runs
from roboirg.evaluation.records.record import Job, Record


def render(
    records: Sequence[Record],
    folder: Path | None = None,
    planned: Sequence[Job] = (),
    name: str = "",
) -> str:
    """Return the page of one run; its videos are in the folder."""
    return render_runs([Run(name, records, folder, planned)])
