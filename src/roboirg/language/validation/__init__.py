"""The proof that the words are valid: one goal, not without context, no leaks, paired words."""

from __future__ import annotations

from roboirg.language.validation.episode_checks import check_episode
from roboirg.language.validation.evidence import RuleViolation, ValidationResults
from roboirg.language.validation.validation_run import (
    Batch,
    batches,
    random_episode,
    validate,
    validate_batch,
)

__all__ = [
    "Batch",
    "RuleViolation",
    "ValidationResults",
    "batches",
    "check_episode",
    "random_episode",
    "validate",
    "validate_batch",
]
