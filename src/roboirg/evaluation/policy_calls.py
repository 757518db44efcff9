"""What a policy returns, checked before anything else reads it."""

from __future__ import annotations

import json
import math
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from roboirg.core.actions import ActionSpace, check_chunk
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.core.observations import Observation
from roboirg.core.plain_text import is_encodable
from roboirg.policies.contract.base import Policy

MAX_ROWS = 10_000
"""Most actions that a policy may return at once; an episode has 1300 steps."""

MAX_METADATA_LENGTH = 65_536
"""Most characters of JSON in a policy's metadata."""

MAX_COSTS = 64
"""Most entries of a policy's usage."""


def next_actions(policy: Policy, observation: Any, space: ActionSpace) -> NDArray[np.float64]:  # noqa: ANN401
    """Return the policy's next actions.

    Raises:
        InvalidActionError: an action is invalid, or there are too many.
    """
    return check_rows(policy.act(cast("Observation", observation)), space)


def check_rows(rows: Any, space: ActionSpace) -> NDArray[np.float64]:  # noqa: ANN401
    """Return what a policy's `act` returned as a chunk (n, size).

    Raises:
        InvalidActionError: an action is invalid, or there are too many.
    """
    count = len(rows) if hasattr(rows, "__len__") else 0
    if count > MAX_ROWS:
        raise InvalidActionError(f"{count} actions at once are too many; at most {MAX_ROWS}.")
    return check_chunk(rows, space)


def policy_metadata(policy: Policy) -> dict[str, JsonValue]:
    """Return the policy's metadata exactly as a reader of the record gets them.

    Raises:
        InvalidValueError: they are too long, or their text is not Unicode.
        TypeError: they hold something that JSON does not.
        ValueError: they hold a number that is not finite.
    """
    text = json.dumps(dict(getattr(policy, "metadata", {})), allow_nan=False, ensure_ascii=False)
    if len(text) > MAX_METADATA_LENGTH:
        raise InvalidValueError(
            f"the policy's metadata have {len(text)} characters of JSON; "
            f"at most {MAX_METADATA_LENGTH} are allowed."
        )
    if not is_encodable(text):
        raise InvalidValueError("the policy's metadata hold text with lone surrogates.")
    return cast("dict[str, JsonValue]", json.loads(text))


def policy_usage(policy: Policy) -> dict[str, float]:
    """Return the finite costs that a policy reports; empty if it reports none.

    Raises:
        InvalidValueError: there are too many, or a name is not a short text.
    """
    reported = policy.usage() if hasattr(policy, "usage") else {}
    usage = {str(name): float(value) for name, value in reported.items()}
    if len(usage) > MAX_COSTS or not all(
        len(name) <= MAX_COSTS and is_encodable(name) for name in usage
    ):
        raise InvalidValueError(
            f"usage() has {len(usage)} entries; it may have at most {MAX_COSTS}, with names of at "
            f"most {MAX_COSTS} characters."
        )
    return {name: cost for name, cost in usage.items() if math.isfinite(cost)}
