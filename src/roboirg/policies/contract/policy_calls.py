"""What a policy returns, checked before anything else reads it."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg.core.actions import ActionSpace, check_chunk
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.core.field_types import SUBGOAL, as_name
from roboirg.core.plain_text import clip_text, is_encodable
from roboirg.core.subgoal_text import MOST_SUBGOAL_LETTERS
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.json_values import as_json

MAX_ROWS = 10_000
"""Most actions that a policy may return at once; an episode has 1300 steps."""

MAX_METADATA_LENGTH = 65_536
"""Most characters of JSON in a policy's metadata."""

REAL_TRIAL = "real_trial"
"""Key of a study's trial in a record's metadata of the policy."""

SERVER = "server"
"""Key under which clients of remote policies name the address of the server."""

_TOO_LARGE = 2**63
_METADATA = "the policy's metadata"

MAX_COSTS = 64
"""Most entries of a policy's usage."""
MAX_COST_LETTERS = 64
"""Most characters of an entry's name."""
GUESSED = "guessed"
"""The entry of a policy's usage for an episode whose words mean nothing to it."""


def check_rows(rows: Any, space: ActionSpace) -> NDArray[np.float64]:  # noqa: ANN401
    """Return what a policy's `act` returned as a chunk (n, size).

    Raises:
        InvalidActionError: an action is invalid, or there are too many.
    """
    count = len(rows) if hasattr(rows, "__len__") else 0
    if count > MAX_ROWS:
        raise InvalidActionError(f"Actions at once: expected at most {MAX_ROWS:,}, got {count:,}.")
    return check_chunk(rows, space)


def policy_subgoal(policy: Policy) -> str | None:
    """Return the subgoal that the policy names after its `act`; None if it names none.

    Raises:
        InvalidValueError: it is no short text, or has characters that control a terminal.
    """
    subgoal = getattr(policy, "subgoal", None)
    if subgoal is None or subgoal == "":
        return None
    is_text = isinstance(subgoal, str) and re.fullmatch(SUBGOAL, subgoal) is not None
    if not (is_text and is_encodable(subgoal)):
        raise InvalidValueError(
            f"The policy's subgoal is {clip_text(repr(subgoal), 80)}; it must be a text of "
            f"at most {MOST_SUBGOAL_LETTERS} characters, without control characters or lone "
            "surrogates."
        )
    return str.__str__(subgoal)  # of a subclass, too


def policy_metadata(policy: Policy, *, is_ours: bool = True) -> dict[str, JsonValue]:
    """Return the policy's metadata exactly as a reader of the record gets them.

    Args:
        policy: any policy.
        is_ours: whether it is our own code, which may name its ``server``.

    Raises:
        InvalidValueError: they hold something that is not JSON, are too long or too deep, their
            text is not Unicode, or a key is reserved.
    """
    return _checked(getattr(policy, "metadata", {}), is_ours=is_ours)


def dump_metadata(policy: Policy) -> str:
    """Return the policy's metadata as JSON; raises like `policy_metadata`."""
    return json.dumps(policy_metadata(policy), ensure_ascii=False)


def read_metadata(text: str) -> dict[str, JsonValue]:
    """Return the metadata in a JSON text of a policy's process; raises like `policy_metadata`."""
    try:
        return _checked(json.loads(text), is_ours=False)
    except RecursionError:
        raise InvalidValueError(f"{_METADATA} are nested too deep.") from None


def _checked(metadata: object, *, is_ours: bool) -> dict[str, JsonValue]:
    """Return a policy's metadata as JSON values, or raise like `policy_metadata`.

    Args:
        metadata: of the policy; anything but a mapping is refused.
        is_ours: whether the policy's code is ours; only that may use the key `SERVER`.
    """
    if not isinstance(metadata, Mapping):
        raise InvalidValueError(f"{_METADATA} are a {type(metadata).__name__}, not a dict.")
    values: dict[str, JsonValue] = as_json(metadata, _METADATA)
    text = json.dumps(values, ensure_ascii=False)
    if len(text) > MAX_METADATA_LENGTH:
        raise InvalidValueError(
            f"{_METADATA} have {len(text)} characters of JSON; "
            f"at most {MAX_METADATA_LENGTH} are allowed."
        )
    if not is_encodable(text):
        raise InvalidValueError(f"{_METADATA} hold text with lone surrogates.")

    keys = set(values)
    of_follower = values.get("policy")  # a planner's metadata hold those of the policy behind it
    if isinstance(of_follower, dict):
        keys.update(of_follower)
    reserved = [REAL_TRIAL]
    if not is_ours:
        reserved.append(SERVER)
    for key in reserved:
        if key in keys:
            raise InvalidValueError(
                f"{_METADATA} have the key {key!r}, which is reserved; choose another name."
            )
    return values


def policy_usage(policy: Policy) -> dict[str, float]:
    """Return the costs that a policy reports, such as ``{"calls": 3.0}``; empty if it reports none.

    Costs below 0, of `_TOO_LARGE` or more, and NaN, which means that one is unknown, are left out.

    Raises:
        InvalidValueError: there are too many, a name is not a short text, or a cost no number.
    """
    if not hasattr(policy, "usage"):
        return {}
    usage: dict[str, float] = {}
    for name, value in policy.usage().items():
        usage[str(name)] = _cost(name, value)
    are_names = all(len(name) <= MAX_COST_LETTERS and is_encodable(name) for name in usage)
    if len(usage) > MAX_COSTS or not are_names:
        raise InvalidValueError(
            f"usage() has {len(usage)} entries; it may have at most {MAX_COSTS}, with names of at "
            f"most {MAX_COST_LETTERS} characters."
        )
    return {name: cost for name, cost in usage.items() if 0 <= cost < _TOO_LARGE}


def _cost(name: object, value: Any) -> float:  # noqa: ANN401 - whatever the policy reports
    """Return a cost as a number; infinity for a whole number that is too large for a float."""
    try:
        return float(value)
    except (TypeError, ValueError):
        shown = clip_text(repr(value), MAX_COST_LETTERS)
        raise InvalidValueError(f"usage() has {shown} as {name!r}; it must be a number.") from None
    except OverflowError:
        return math.inf


def server_version(metadata: Mapping[str, Any]) -> str | None:
    """Return the version that a policy's server reported; None without a server or a version.

    Args:
        metadata: of the policy, or of a planner and a policy, after `reset`. Those of clients hold
            the address of the ``server`` and what it reported, such as its ``version``.
    """
    # Behind a planner, the metadata of the policy are an entry of the planner's.
    for of_client in (metadata, metadata.get("policy")):
        if isinstance(of_client, Mapping) and SERVER in of_client:
            version = of_client.get("version")
            return None if version in (None, "", "unknown") else as_name(str(version))
    return None
