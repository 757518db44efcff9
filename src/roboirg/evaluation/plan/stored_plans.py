"""The plans that a run's folder keeps next to its records: the newest one, and earlier ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.line_file import warn_once
from roboirg.evaluation.records.run_files import (
    MOST_PLAN_BYTES,
    PLAN_FILE,
    earlier_plans,
    store_plan,
)
from roboirg.util.regular_file import read_regular


def write_plan(plan: Plan, folder: Path) -> None:
    """Write the newest plan of a folder next to its records; earlier ones stay in ``plans/``."""
    store_plan((plan.model_dump_json(indent=2) + "\n").encode(), folder)


def read_plan(folder: Path) -> Plan | None:
    """Return the newest plan of a folder; None if it is missing or cannot be read."""
    return next(_plans([folder / PLAN_FILE]), None)


def read_plans(folder: Path) -> tuple[Plan, ...]:
    """Return the plans whose episodes a folder should hold.

    That is the newest, or in a merged run those of its parts.
    """
    return tuple(_plans([folder / PLAN_FILE])) or tuple(_plans(earlier_plans(folder)))


def _plans(paths: Iterable[Path]) -> Iterator[Plan]:
    """Yield the plans of the files that hold one; a warning names a file that holds none."""
    for path in paths:
        try:
            yield Plan.model_validate_json(read_regular(path, MOST_PLAN_BYTES))
        except FileNotFoundError:
            continue
        except (OSError, ValueError):
            warn_once(f"{path} is not a readable plan, so its missing episodes are not counted.")
