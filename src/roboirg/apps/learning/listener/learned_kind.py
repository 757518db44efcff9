"""The kind of policies that ``learned:PATH`` names: a trained listener names the goal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.by_name.policy_kinds import PolicyKind, PolicyMaker


def _learned(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    from roboirg.apps.learning.listener.learned_listener import LearnedListener

    for option in options:
        raise UnknownNameError("option of learned:", option, [])
    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no file.")
    return lambda seed: LearnedListener(Path(name), seed)


KIND = PolicyKind("learned", _learned)
