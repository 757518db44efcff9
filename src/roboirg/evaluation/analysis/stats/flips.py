"""How often a policy's verdicts change when the same run is played again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.util.regular_file import read_regular

FLIPS_FILE = "flips.json"
_MOST_BYTES = 4_000_000


@dataclass(frozen=True)
class FlipCounts:
    """Counts over repeated episodes.

    Attributes:
        both: episodes that succeeded in both runs.
        neither: that failed in both.
        lost: that succeeded only in the first run.
        gained: that succeeded only in the second.
        acted_differently: whose actions differ.
        errors: without a verdict in one of the runs; in none of the other counts.
    """

    both: int = 0
    neither: int = 0
    lost: int = 0
    gained: int = 0
    acted_differently: int = 0
    errors: int = 0

    @property
    def verdicts(self) -> int:
        """Number of episodes with two verdicts."""
        return self.both + self.neither + self.lost + self.gained

    @property
    def flips(self) -> int:
        """Number of episodes whose verdict changed."""
        return self.lost + self.gained

    def __str__(self) -> str:
        """Return the share of verdicts that changed, in words."""
        if not self.verdicts:
            return "no verdict twice"
        return f"{100 * self.flips / self.verdicts:.1f} % ({self.flips:,} of {self.verdicts:,})"


Flips = Mapping[tuple[str, InstructionOptions], FlipCounts]
"""Counts by policy and kind of instruction."""


def read_flips(folder: Path) -> Flips:
    """Return what `write_flips` kept in the folder of a run; empty if it was never repeated."""
    path = folder / FLIPS_FILE
    try:
        rows = json.loads(read_regular(path, _MOST_BYTES))
        return {
            (row["policy"], _options(row["options"])): FlipCounts(**row["counts"]) for row in rows
        }
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise StoreError(
            f"{path} is damaged; `roboirg leaderboard repeat` writes it again."
        ) from error


def _options(fields: Mapping[str, Any]) -> InstructionOptions:
    return InstructionOptions(**{**fields, "stages": tuple(fields["stages"])})
