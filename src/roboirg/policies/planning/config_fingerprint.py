"""What tells one configuration of a model from another in the records."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from roboirg.policies.planning.models import ModelOptions

FINGERPRINT_LENGTH = 12
"""Hexadecimal digits."""


def fingerprint_of(model: ModelOptions, about: Mapping[str, Any]) -> str:
    """The model's name and a fingerprint of all else that may change what it answers."""
    settled = json.dumps(_without_address(about), sort_keys=True)
    digest = hashlib.sha256(settled.encode()).hexdigest()
    return f"{model.model} {digest[:FINGERPRINT_LENGTH]}"


def _without_address(about: object) -> object:
    """The same model at another port is the same model."""
    if isinstance(about, Mapping):
        return {name: _without_address(held) for name, held in about.items() if name != "address"}
    return about
