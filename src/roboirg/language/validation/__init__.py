"""The proof that the words are valid: one goal, not without context, no leaks, paired words."""

from __future__ import annotations

from roboirg.language.validation.episode_checks import examine
from roboirg.language.validation.evidence import Evidence, Failure
from roboirg.language.validation.validation_run import (
    Batch,
    batches,
    prove,
    random_episode,
    work_on,
)

__all__ = [
    "Batch",
    "Evidence",
    "Failure",
    "batches",
    "examine",
    "prove",
    "random_episode",
    "work_on",
]
