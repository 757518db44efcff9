"""Versions that distinguish the configurations of a model in the records."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from roboirg.policies.vlm.models import ModelOptions
from roboirg.util.short_hash import short_hash


def config_version(model: ModelOptions, about: Mapping[str, Any]) -> str:
    """Return the model's name and a fingerprint of all else that may change its answers."""
    canonical = json.dumps(_without_address(about), sort_keys=True)
    return f"{model.model} {short_hash(canonical)}"


def _without_address(about: object) -> object:
    """Leave out addresses: a model at another port is the same model."""
    if isinstance(about, Mapping):
        return {name: _without_address(value) for name, value in about.items() if name != "address"}
    return about
