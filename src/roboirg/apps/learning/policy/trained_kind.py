"""The kind of policies that ``trained:PATH`` names: a policy that learned to act."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.by_name.policy_specs import PolicyKind, PolicyMaker


def _trained(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    from roboirg.apps.learning.policy.learned_policy import LearnedPolicy

    for option in options:
        raise UnknownNameError("option of trained:", option, [])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    return lambda seed: LearnedPolicy(Path(name), seed)


KIND = PolicyKind("trained", _trained, has_weights=True)
