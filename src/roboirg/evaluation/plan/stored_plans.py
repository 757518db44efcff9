"""The plans that a run's folder keeps next to its records: the newest one, and earlier ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import is_encodable
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.run_files import (
    MOST_PLAN_BYTES,
    PLAN_FILE,
    earlier_plans,
    store_plan,
)
from roboirg.util.regular_file import read_regular

_FORMER_FIELDS = ("seed_secret",)
"""Fields of plans in published packs that have no meaning any more."""


def write_plan(plan: Plan, folder: Path) -> None:
    """Write the newest plan of a folder next to its records; earlier ones stay in ``plans/``."""
    store_plan((plan.model_dump_json(indent=2) + "\n").encode(), folder)


def read_plan(folder: Path) -> Plan | None:
    """Return the newest plan of a folder; None if it is missing or of an unknown version."""
    return next((plan for plan in map(_parse, _stored([folder / PLAN_FILE])) if plan), None)


def read_plans(folder: Path) -> tuple[Plan, ...]:
    """Return the plans whose episodes a folder should hold.

    That is the newest, or in a merged run those of its parts.
    """
    newest = read_plan(folder)
    if newest is not None:
        return (newest,)
    found = map(_parse, _stored(earlier_plans(folder)))
    return tuple(plan for plan in found if plan is not None)


def present_fields(data: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a stored plan without those that plans no longer have."""
    return {name: value for name, value in data.items() if name not in _FORMER_FIELDS}


def _stored(paths: list[Path]) -> Iterator[dict[str, Any]]:
    """Yield the contents of the files that hold a JSON object."""
    for path in paths:
        try:
            data = json.loads(read_regular(path, MOST_PLAN_BYTES))
            can_be_written = is_encodable(json.dumps(data, ensure_ascii=False))
        except (OSError, ValueError, RecursionError, InvalidValueError):
            continue
        if isinstance(data, dict) and can_be_written:
            yield data


def _parse(data: dict[str, Any]) -> Plan | None:
    try:
        # As JSON, in which a list is a tuple and nothing else is converted.
        return Plan.model_validate_json(json.dumps(present_fields(data)))
    except (ValueError, InvalidValueError):
        return None
