"""Find the class of a policy: built in, by import path, or by URL scheme."""

from __future__ import annotations

import functools
import importlib
import inspect
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from roboirg.core.error_words import one_line
from roboirg.core.errors import (
    InvalidValueError,
    MissingDependencyError,
    UnknownNameError,
    check_names,
)
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.batch_policy import make_batched, parameters_of, takes_batches
from roboirg.policies.contract.contract_check import check_policy
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.lerobot.checkpoint_policy import LeRobotPolicy
from roboirg.policies.remote.protocols import protocols_by_scheme
from roboirg.util.discovery import entry_names

_MOST_LISTED = 20
"""Classes of a module that an error message lists at most."""
CHECKPOINTS: Mapping[str, type[Any]] = {"lerobot": LeRobotPolicy}
"""Policies of this process that a URL names, by its scheme; called with ``(url, seed=)``."""

KINDS_GROUP = "roboirg.policy_kinds"
"""Entry points of packages that add kinds of policies; our applications add theirs so, too."""


def url_classes() -> Mapping[str, type[Any]]:
    """Return the classes of policies that URLs name, by scheme: ``openpi`` and others."""
    clients = {scheme: protocol.client for scheme, protocol in protocols_by_scheme().items()}
    return {**clients, **CHECKPOINTS}


def url_forms() -> list[str]:
    """Return the forms of URLs, such as ``openpi://…``, for help and error messages."""
    return [f"{scheme}://…" for scheme in url_classes()]


def find_class(spec: str, methods: tuple[str, ...] = ("reset", "act")) -> type[Any]:
    """Return the class of policies that a spec names, checked; its module is imported.

    Args:
        spec: a built-in name such as ``oracle``, ``package.module:Class``, or a URL.
        methods: that the class must have.

    Raises:
        UnknownNameError: the spec is none of them, or the URL has an unknown option.
        InvalidValueError: the module or class cannot be imported or is not a policy, or the URL
            is malformed.
        MissingDependencyError: a library that the URL's scheme needs is not installed.
    """
    if is_url(spec):
        scheme, _, _ = spec.partition("://")
        classes = url_classes()
        check_names("policy scheme", [scheme], classes)
        url_class = classes[scheme]
        # One is made for the check, which also checks the URL's options; nothing connects yet.
        check_policy(spec, url_class(spec), methods)
        return url_class

    if spec not in BUILTIN and ":" not in spec:
        raise UnknownNameError("policy", spec, _known_specs())

    found = _import_class(spec)
    check_policy(spec, found, methods)
    return found


def _known_specs() -> list[str]:
    """Return the forms of specs, such as ``oracle`` and ``openpi://…``, for an error message."""
    kinds = ["system:NAME", "planner:KIND", "vlm-listener:PROVIDER"]
    kinds += [f"{kind}:…" for kind in entry_names(KINDS_GROUP)]
    return [*BUILTIN, "package.module:Class", *url_forms(), *kinds]


def make_from_class(spec: str, policy_class: type[Any], seed: int) -> Policy:
    """Make a policy of the class that `find_class` returned for a spec.

    Args:
        spec: passed to the constructor if it is a URL, as it holds the address and options.
        policy_class: called with ``seed=`` if it takes it, else without arguments.
        seed: of the policy's own random choices. A policy that takes batches is made once, with
            seed 0, and gets the seed of each episode in ``begin``.
    """
    if takes_batches(policy_class):
        make = functools.partial(_construct, spec, policy_class, seed=0)
        return make_batched((spec, policy_class), make, seed)
    policy: Policy = _construct(spec, policy_class, seed)
    return policy


def _construct(spec: str, policy_class: type[Any], seed: int) -> Any:  # noqa: ANN401
    """Return a new policy of a class, which gets the spec, if that is a URL, and the seed.

    A class of a user's gets the seed only if it has such a parameter.
    """
    if is_url(spec):
        return policy_class(spec, seed=seed)
    if "seed" in parameters_of(policy_class):
        return policy_class(seed=seed)
    return policy_class()


def _import_class(spec: str) -> type[Any]:
    """Return the class of a built-in name or of ``package.module:Class``; imports its module.

    If the module has no such class, the `InvalidValueError` lists those that it has.
    """
    module_name, _, class_name = BUILTIN.get(spec, spec).partition(":")
    module = _import_module(spec, module_name)
    found = getattr(module, class_name, None)
    if inspect.isclass(found):
        return found
    classes = [name for name, value in vars(module).items() if inspect.isclass(value)]
    listed = ", ".join(classes[:_MOST_LISTED]) or "none"
    raise InvalidValueError(
        f"Policy {spec!r}: module {module_name} has no class {class_name!r}; it has {listed}."
    )


def _import_module(spec: str, name: str) -> ModuleType:
    """Import a module by its name, and return it.

    What the import raises becomes an `InvalidValueError`, which lists the modules of the working
    folder if there is none of that name. Only `MissingDependencyError` passes as it is.

    Args:
        spec: of the policy, for the error.
        name: of the module.
    """
    try:
        return importlib.import_module(name)
    except MissingDependencyError:
        raise
    except (Exception, SystemExit) as error:
        hint = ""
        top_package = name.partition(".")[0]
        # Not where the module exists, and another one that it imports is missing.
        if isinstance(error, ModuleNotFoundError) and error.name == top_package:
            modules_here = sorted(path.stem for path in Path.cwd().glob("*.py"))
            listed = ", ".join(modules_here) or "none"
            hint = f"; modules in {str(Path.cwd())!r}: {listed}"
        raise InvalidValueError(
            f"Policy {spec!r}: module {name!r} cannot be imported: {one_line(error)}{hint}."
        ) from error
