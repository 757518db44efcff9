"""The two files of a policy: a body, and a reader of words for it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote


class PolicyFiles(NamedTuple):
    """Where a body and its reader are."""

    body: Path
    reader: Path

    @property
    def spec(self) -> str:
        """How `roboirg run` names this policy: ``trained:a.safetensors?reader=b.safetensors``."""
        return f"trained:{self.body}?reader={quote(str(self.reader))}"

    @property
    def changed(self) -> tuple[int, ...]:
        """When each that is there was written, in nanoseconds since 1970."""
        return tuple(path.stat().st_mtime_ns for path in self if path.exists())
