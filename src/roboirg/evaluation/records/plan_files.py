"""Which files of a run's folder hold its plans: the newest, and those of earlier commands."""

from __future__ import annotations

from pathlib import Path

from roboirg.util.atomic_write import write_atomically
from roboirg.util.short_hash import short_hash

PLAN_FILE = "plan.json"
EARLIER_PLANS = "plans"


def store_plan(content: bytes, folder: Path) -> None:
    """Write the newest plan of a run; another one that was there goes to ``plans/``.

    Raises:
        InvalidValueError: a file cannot be written.
    """
    newest = folder / PLAN_FILE
    if newest.is_file():
        before = newest.read_bytes()
        if before == content:
            return
        keep_earlier_plan(before, folder)
    write_atomically(newest, content)


def keep_earlier_plan(content: bytes, folder: Path) -> None:
    """Write a plan that is not the newest.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    path = folder / EARLIER_PLANS / f"{short_hash(content)}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)


def earlier_plans(folder: Path) -> list[Path]:
    """Return the files of plans that are not the newest, sorted by name."""
    return sorted((folder / EARLIER_PLANS).glob("*.json"))
