"""The plans that a run's folder keeps next to its records: the newest one, and earlier ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from roboirg.records.line_file import warn_once
from roboirg.records.run_files import (
    MOST_PLAN_BYTES,
    PLAN_FILE,
    earlier_plans,
    store_plan,
)
from roboirg.runs.plan.plan import Plan
from roboirg.util.regular_file import read_regular


def write_plan(plan: Plan, folder: Path) -> None:
    """Write the newest plan of a folder next to its records; earlier ones stay in ``plans/``."""
    text = plan.model_dump_json(indent=2) + "\n"
    store_plan(text.encode(), folder)


def read_plan(folder: Path) -> Plan | None:
    """Return the newest plan of a folder; None if it is missing or cannot be read."""
    for plan in _plans([folder / PLAN_FILE]):
        return plan
    return None


def read_plans(folder: Path) -> tuple[Plan, ...]:
    """Return the plans whose episodes the folder of a run should hold.

    That is the newest plan; a merged run has none, but the plans of its parts.
    """
    newest = read_plan(folder)
    if newest is not None:
        return (newest,)
    return tuple(_plans(earlier_plans(folder)))


def read_kept_plans(folder: Path) -> tuple[Plan, ...]:
    """Return the plans of all commands that wrote to a folder, as far as they are kept."""
    return tuple(_plans([folder / PLAN_FILE, *earlier_plans(folder)]))


def _plans(paths: Iterable[Path]) -> Iterator[Plan]:
    """Yield the plan in each file; a missing file is skipped, an unreadable one with a warning."""
    for path in paths:
        try:
            yield Plan.model_validate_json(read_regular(path, MOST_PLAN_BYTES))
        except FileNotFoundError:
            continue
        except (OSError, ValueError):
            warn_once(f"{path} is not a readable plan, so its missing episodes are not counted.")
