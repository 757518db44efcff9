"""Which environment variables a user's policy gets: no secrets but those that are meant for it."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable, Iterator

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.by_name.policy_kinds import split_spec, system_of
from roboirg.policies.planners.systems import System
from roboirg.policies.vlm.models import ModelOptions

_SECRET = re.compile(
    "(KEYS?|TOKENS?|SECRETS?|PASS|PASSWORDS?|PASSWD|PASSPHRASE|PASSCODE|CREDENTIALS?|CREDS"
    r"|AUTH|AUTHORIZATION|COOKIES?|_PWD?|_PAT)\d*(_|$)",
    re.IGNORECASE,
)
"""A word in the names of variables that hold secrets: HF_TOKEN, AWS_ACCESS_KEY_ID, DB_PW."""
_HUB_KEYS = {"lerobot": "HF_TOKEN"}
"""By kind of policy, the variable with the key that loads checkpoints that are not public."""


def check_variables(names: Iterable[str], receivers: str) -> None:
    """Raise if one of some environment variables is not set; an empty one is.

    Args:
        names: of the variables.
        receivers: who is to get them, in the plural, for the error: ``policies``.

    Raises:
        InvalidValueError: one of them is not set.
    """
    for name in names:
        if name not in os.environ:
            raise InvalidValueError(
                f"The environment variable {name} is not set here, so {receivers} cannot get it."
            )


def environment_for(ref: PolicyRef, named: Iterable[str]) -> dict[str, str]:
    """Return this process's environment without secrets that a policy is not meant to have.

    A variable is a secret by its name: ``MY_PASSWORD`` is left out, ``PATH`` is not.

    Args:
        ref: the policy; the keys that our own parts of it read are kept, see `key_variables`.
        named: secrets that the user lets it have, by name.
    """
    granted = key_variables(ref).union(named)
    return {
        name: value
        for name, value in os.environ.items()
        if name in granted or not _SECRET.search(name)
    }


def key_variables(ref: PolicyRef) -> set[str]:
    """Return the names of the environment variables from which a policy's parts read keys.

    ``lerobot://lab/checkpoint`` -> HF_TOKEN; ``planner:stateless?model=m&hands=mine:It`` ->
    OPENAI_API_KEY, for the model of the planner. Only parts that are ours count, as a user's code
    (``mine:It``) does not say what it reads. A malformed spec has only the keys of its own options.
    """
    options = dict(ref.options)
    names = {options.get("api_key_env"), _HUB_KEYS.get(ref.kind)}
    with contextlib.suppress(InvalidValueError, KeyError):  # then it cannot be made, either
        system = system_of(ref.kind, ref.target, options)
        if system is not None:
            names.update(_keys_of_system(system))
    return {name for name in names if name is not None}


def _keys_of_system(system: System) -> Iterator[str | None]:
    """Yield the variables from which a system's hands read keys, then that of its planner's model.

    None for a model that needs no key.
    """
    yield from key_variables(split_spec(system.policy, system.policy))
    if "model" in system.planner_options:
        # The options are not checked: that happens where the planner is made.
        model = ModelOptions.model_construct(**system.planner_options["model"])
        yield model.key_variable
