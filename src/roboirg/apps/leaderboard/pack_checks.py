"""Verify packed runs, and remember the result in the site, where no submission can put one."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import NamedTuple

from roboirg.apps.leaderboard.packing import file_hash, opened_run
from roboirg.apps.leaderboard.record_check import ReplayVerdict
from roboirg.apps.leaderboard.run_verification import Verification, verify_run
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import counted
from roboirg.language import LANGUAGE_VERSION
from roboirg.tasks.splits.private_splits import MissingSaltError
from roboirg.util.atomic_write import write_atomically
from roboirg.util.regular_file import read_regular

CHECKS_FILE = "checks.json"
_MOST_BYTES = 64_000_000
"""Of the remembered checks."""


class PackCheck(NamedTuple):
    """What was found in a packed run.

    Attributes:
        pack: SHA-256 of the file.
        versions: of world and words that it was checked with.
        records: number of records.
        played: number of them whose actions were played again.
        problem: what does not hold, in words; empty if nothing was found.
    """

    pack: str
    versions: str
    records: int
    played: int
    problem: str = ""


def check_pack(path: Path, site: Path, *, sample: float, workers: int) -> PackCheck | None:
    """Verify a packed run, unless an equal or larger sample of the same file was checked before.

    None if it has private episodes whose salt is not known.

    Args:
        path: of the file.
        site: folder of the board, which keeps the result in `CHECKS_FILE`.
        sample: share of the episodes whose actions are played, 0 to 1.
        workers: number of processes; 0 uses this one only.
    """
    digest = file_hash(path)
    known = read_check(path, site, digest)
    if known is not None and (known.problem or known.played >= round(sample * known.records)):
        return known
    try:
        with opened_run(path) as folder:
            found = _summary(digest, verify_run(folder, sample=sample, workers=workers))
    except MissingSaltError:
        return None
    except RoboIRGError as error:
        found = PackCheck(digest, _versions(), 0, 0, str(error))
    _remember(path, site, found)
    return found


def read_check(path: Path, site: Path, digest: str | None = None) -> PackCheck | None:
    """Return the check of a packed run by these versions that a site keeps; None without one."""
    kept = _kept(site).get(path.name)
    current = kept is not None and kept.versions == _versions()
    return kept if current and kept and kept.pack == (digest or file_hash(path)) else None


def _summary(digest: str, found: Verification) -> PackCheck:
    played = found.records - found.verdicts[ReplayVerdict.NOT_REPLAYED]
    return PackCheck(digest, _versions(), found.records, played, _problem(found))


def _problem(found: Verification) -> str:
    """Return the first thing that does not hold, and how many more there are."""
    parts = [f"{check.slug}: {check.findings[0]}" for check in found.checks]
    parts += [f"no record of {slug}" for slug in found.missing]
    parts += [f"several verdicts on {slug}" for slug in found.doubled]
    if not parts:
        return ""
    more = f" (and {counted(len(parts) - 1, 'more thing')})" if len(parts) > 1 else ""
    return parts[0] + more


def _versions() -> str:
    return f"environment {ENVIRONMENT_VERSION}, language {LANGUAGE_VERSION}"


def _kept(folder: Path) -> dict[str, PackCheck]:
    with contextlib.suppress(OSError, ValueError, TypeError, AttributeError, RecursionError):
        stored = json.loads(read_regular(folder / CHECKS_FILE, _MOST_BYTES))
        return {name: PackCheck(**check) for name, check in stored.items()}
    return {}


def _remember(path: Path, site: Path, found: PackCheck) -> None:
    kept = {**_kept(site), path.name: found}
    text = json.dumps({name: kept[name]._asdict() for name in sorted(kept)}, indent=1)
    write_atomically(site / CHECKS_FILE, text + "\n")
