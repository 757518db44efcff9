"""Validation of the instructions: read every one back, and check its rules."""

from __future__ import annotations

from roboirg.language.validation.episode_checks import check_episode
from roboirg.language.validation.validation_results import RuleViolation, ValidationResults
from roboirg.language.validation.validation_run import (
    Batch,
    batches,
    validate,
    validate_batch,
)

__all__ = [
    "Batch",
    "RuleViolation",
    "ValidationResults",
    "batches",
    "check_episode",
    "validate",
    "validate_batch",
]
