"""Validation of the instructions: read every one back, and check its rules."""

from __future__ import annotations

from roboirg.apps.language_lab.validation.episode_checks import check_episode
from roboirg.apps.language_lab.validation.validation_results import RuleViolation, ValidationResults
from roboirg.apps.language_lab.validation.validation_run import (
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
