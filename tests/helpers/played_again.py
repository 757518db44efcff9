"""Play some episodes of a pack again."""

from __future__ import annotations

from pathlib import Path

from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.evaluation.records.packs import opened_run


def assert_holds_here(pack: Path, sample: float) -> None:
    """Assert that a pack holds, as far as this kind of processor can show it.

    On a processor of another maker than the record's, one episode in ten moves differently.
    """
    with opened_run(pack) as run:
        found = verify_run(run, sample=sample)
    here = [one for one in found.checks if not one.elsewhere]
    assert (here, found.missing) == ([], ())
