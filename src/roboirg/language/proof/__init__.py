"""The proof that the words are valid: one goal, not without context, no leaks, paired words."""

from __future__ import annotations

from roboirg.language.proof.evidence import Evidence, Failure
from roboirg.language.proof.examine import examine
from roboirg.language.proof.run import Batch, batches, prove, random_episode, work_on

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
