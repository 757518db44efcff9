"""Which environment variables a policy of a stranger gets: no keys but those meant for it."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.by_name.policy_kinds import split_spec, system_of
from roboirg.policies.vlm.models import ModelOptions

_SECRET = re.compile(
    "(KEYS?|TOKENS?|SECRETS?|PASS|PASSWORDS?|PASSWD|PASSPHRASE|PASSCODE|CREDENTIALS?|CREDS"
    r"|AUTH|AUTHORIZATION|COOKIES?|_PWD?|_PAT)\d*(_|$)",
    re.IGNORECASE,
)
"""In the names of variables that hold secrets, such as HF_TOKEN or AWS_ACCESS_KEY_ID."""
_HUB_KEYS = {"lerobot": "HF_TOKEN"}
"""With which policies of a kind load checkpoints that are not public."""


def check_variables(names: Iterable[str], receivers: str) -> None:
    """Check that environment variables are set.

    Args:
        names: of the variables.
        receivers: who is to get them, in the plural.

    Raises:
        InvalidValueError: one of them is not set.
    """
    missing = [name for name in names if name not in os.environ]
    if missing:
        raise InvalidValueError(
            f"The environment variable {missing[0]} is not set here, so {receivers} cannot get it."
        )


def environment_for(ref: PolicyRef, named: Iterable[str]) -> dict[str, str]:
    """Return this process's environment without secrets that a policy is not meant to have.

    Args:
        ref: the policy; it has the keys that our own parts of it read.
        named: variables that the user lets it have.
    """
    granted = key_variables(ref).union(named)
    return {
        name: value
        for name, value in os.environ.items()
        if name in granted or not _SECRET.search(name)
    }


def key_variables(ref: PolicyRef) -> set[str]:
    """Return the names of the environment variables with keys that a policy reads.

    Only parts that are ours count: a client, its planner's model, and the hands of a system.
    """
    options = dict(ref.options)
    names = {options.get("api_key_env"), _HUB_KEYS.get(ref.kind)}
    with contextlib.suppress(InvalidValueError, KeyError):  # then it cannot be made, either
        system = system_of(ref.kind, ref.target, options)
        if system is not None:
            names |= key_variables(split_spec(system.policy, system.policy))
            if "model" in system.planner_options:
                model = ModelOptions.model_construct(**system.planner_options["model"])
                names.add(model.key_variable)
    return {name for name in names if name is not None}
