"""Checks of the contract that need no episode: what a class, or an object, must have."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.contract.batch_policy import takes_batches

ARGUMENTS: Mapping[str, tuple[str, ...]] = {
    "reset": ("instruction", "demonstration"),
    "act": ("observation",),
    "plan": ("observation", "step"),
}
"""What the methods of a policy or a planner are called with."""


def check_policy(spec: str, policy: object, methods: tuple[str, ...]) -> None:
    """Raise for a policy, or a class of policies, with which every episode would end in an error.

    What shows only when a policy is made, such as a missing argument, is found when it is opened.
    Arguments are checked of classes only: an object's methods may be anything callable.

    Args:
        spec: of the policy, for errors.
        policy: the policy or the class.
        methods: that it must have; one that takes batches is checked without them.

    Raises:
        InvalidValueError: the message names the policy and what is wrong.
    """
    kind = policy if isinstance(policy, type) else type(policy)
    if takes_batches(policy):
        if hasattr(policy, "attach"):
            raise InvalidValueError(
                f"Policy {spec!r}: class {kind.__name__} has attach() and act_batch(); a "
                "privileged policy is asked about one episode at a time."
            )
        methods = ()
    for name in methods:
        method = getattr(policy, name, None)
        if not callable(method):
            raise InvalidValueError(
                f"Policy {spec!r}: class {kind.__name__} has no method {name}()."
            )
        if policy is kind and name in ARGUMENTS:
            _check_arguments(spec, method, ARGUMENTS[name])
    try:
        PolicyNeeds.of(policy)
    except InvalidValueError as error:
        raise InvalidValueError(f"Policy {spec!r}: {error}") from error


def _check_arguments(spec: str, method: Callable[..., Any], takes: tuple[str, ...]) -> None:
    """Raise for a method of a class that cannot be called with the arguments that it gets.

    Args:
        spec: of the policy, for the error.
        method: not bound to an object, so `self` is its first argument.
        takes: names of the positional arguments, for the error, too.
    """
    try:
        inspect.signature(method).bind(None, *takes)
    except ValueError:  # a method written in C may have no signature
        return
    except TypeError as error:
        raise InvalidValueError(
            f"Policy {spec!r}: {method.__qualname__}{inspect.signature(method)} must take "
            f"{' and '.join(takes)}."
        ) from error
