"""How a name on the command line becomes a policy."""

from __future__ import annotations

import hashlib
import inspect
from pathlib import Path
from typing import Any, cast

from roboirg.core.errors import InvalidValueError
from roboirg.policies.base import Policy
from roboirg.policies.planning import policy_specs
from roboirg.policies.policy_classes import BUILTIN, find_class, make_from_class
from roboirg.policies.policy_urls import is_url

FINGERPRINT_LENGTH = 12
"""Hexadecimal digits."""


def load_policy_class(spec: str) -> type[Any]:
    """The class that a spec names: a built-in name, ``package.module:Class``, or a URL.

    Of ``system:NAME`` and ``vlm-listener:PROVIDER`` (`roboirg.policies.planning.policy_specs`)
    something that makes policies and has a class's attributes.

    Raises:
        UnknownNameError: it is none of them, or the URL gives an option that there is not.
        InvalidValueError: the module or the class cannot be imported, or is not a policy; or
            the URL is malformed.
    """
    factory = policy_specs.find_policy_factory(spec) if ":" in spec else None
    # A factory has all that is asked of a class here.
    return find_class(spec) if factory is None else cast("type[Any]", factory)


def make_policy(spec: str, seed: int) -> Policy:
    """A policy from its spec.

    Args:
        spec: ``oracle``, ``listener``, ``forgetful``, ``random``; ``package.module:Class``,
            which is called with ``seed=`` if it takes it, else without arguments; or a URL.
        seed: of the policy's own random choices.

    Raises:
        UnknownNameError: there is no such built-in policy, scheme or option.
        InvalidValueError: the module or the class cannot be imported, or is not a policy; or
            the URL is malformed.
    """
    return make_from_class(spec, load_policy_class(spec), seed)


def is_privileged(spec: str) -> bool:
    """Whether a spec names a policy that looks behind the scenes."""
    try:
        policy_class = load_policy_class(spec)
        return hasattr(policy_class(spec) if is_url(spec) else policy_class, "attach")
    except InvalidValueError:
        return False


def policy_version(spec: str) -> str:
    """What tells a policy from an earlier one of the same name.

    Its class attribute ``version`` if it has one (a checkpoint's name, say), else a fingerprint of
    the file that defines it; ``built-in``, or ``unknown`` if nothing can be found out. Of a URL
    what its option ``version`` says: nothing is connected to find out more.
    """
    if spec in BUILTIN:
        return "built-in"
    try:
        policy_class = load_policy_class(spec)
        if is_url(spec):
            return str(getattr(policy_class(spec), "version", "unknown"))
        version = getattr(policy_class, "version", None)
        if version is not None:
            return str(version)
        source = Path(inspect.getfile(policy_class)).read_bytes()
    except (InvalidValueError, OSError, TypeError):
        return "unknown"
    return hashlib.sha256(source).hexdigest()[:FINGERPRINT_LENGTH]
