"""The versions that policies' servers report: verdicts of two of them are not mixed in one folder.

Episodes that ended in an error are in no rate, so they do not count; and one that ended before its
server reported a version belongs to the version of the folder's verdicts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeVar

import msgspec

from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.record_codec import StoreError

Stored = TypeVar("Stored", bound=Summary)


def told_versions(records: Iterable[Summary]) -> dict[str, str | None]:
    """Return the version of each policy's server, of those with a verdict; None if unreported."""
    return {one.policy: one.server_version for one in records if one.outcome != "error"}


def check_told_version(folder: Path, told: Mapping[str, str | None], record: Summary) -> None:
    """Refuse a verdict of another version than the folder's.

    Args:
        folder: for the message.
        told: of the folder's records, as from `told_versions`.
        record: to be added.

    Raises:
        StoreError: the version differs.
    """
    before, now = told.get(record.policy, record.server_version), record.server_version
    if record.outcome != "error" and before != now:
        raise StoreError(
            f"{folder} holds episodes of {record.policy} whose server reported {_name(before)}, "
            f"but now it reports {_name(now)}; choose another --out."
        )


def adopt_told_versions(records: Iterable[Stored]) -> tuple[Stored, ...]:
    """Return the records; errors without a version get that of the same policy's verdicts."""
    found = list(records)
    told = told_versions(found)
    return tuple(
        msgspec.structs.replace(one, server_version=told[one.policy])
        if one.outcome == "error" and one.server_version is None and told.get(one.policy)
        else one
        for one in found
    )


def _name(version: str | None) -> str:
    return "no version" if version is None else f"version {version}"
