"""Find the class of a policy: built in, by import path, or by URL scheme."""

from __future__ import annotations

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

_MAX_NAMED = 20
CHECKPOINTS: Mapping[str, type[Any]] = {"lerobot": LeRobotPolicy}
"""Policies of this process that a URL names, by its scheme; called with ``(url, seed=)``."""

KINDS_GROUP = "roboirg.policy_kinds"
"""Entry points of packages that add kinds of policies; our applications add theirs so, too."""


def url_classes() -> Mapping[str, type[Any]]:
    """Return the classes of policies that URLs name, by the scheme."""
    clients = {scheme: one.client for scheme, one in protocols_by_scheme().items()}
    return {**clients, **CHECKPOINTS}


def find_class(spec: str, methods: tuple[str, ...] = ("reset", "act")) -> type[Any]:
    """Return the class of a built-in name, ``package.module:Class``, or a URL.

    Args:
        spec: any of them.
        methods: that the class must have.

    Raises:
        UnknownNameError: the spec is none of them, or the URL has an unknown option.
        InvalidValueError: the module or class cannot be imported or is not a policy, or the URL
            is malformed.
        MissingDependencyError: a library that the URL's scheme needs is not installed.
    """
    if is_url(spec):
        scheme, classes = spec.partition("://")[0], url_classes()
        check_names("policy scheme", [scheme], classes)
        check_policy(spec, classes[scheme](spec), methods)
        return classes[scheme]
    if spec not in BUILTIN and ":" not in spec:
        urls = (f"{scheme}://…" for scheme in url_classes())
        kinds = (f"{kind}:…" for kind in entry_names(KINDS_GROUP))
        ours = ("system:NAME", "planner:KIND", "vlm-listener:PROVIDER")
        known = [*BUILTIN, "package.module:Class", *urls, *ours, *kinds]
        raise UnknownNameError("policy", spec, known)
    module_name, _, name = BUILTIN.get(spec, spec).partition(":")
    module = _module(spec, module_name)
    found = getattr(module, name, None)
    if not inspect.isclass(found):
        names = [key for key, one in vars(module).items() if inspect.isclass(one)]
        raise InvalidValueError(
            f"Policy {spec!r}: module {module_name} has no class {name!r}; "
            f"it has {', '.join(names[:_MAX_NAMED]) or 'none'}."
        )
    check_policy(spec, found, methods)
    return found


def make_from_class(spec: str, policy_class: type[Any], seed: int) -> Policy:
    """Make a policy of the class that `find_class` returned.

    Args:
        spec: passed to the constructor if it is a URL.
        policy_class: called with ``seed=`` if it takes it, else without arguments.
        seed: of the policy's own random choices. A policy that takes batches is made once, with
            seed 0, and gets the seed of each episode in ``begin``.
    """
    if takes_batches(policy_class):
        return make_batched(
            (spec, policy_class), lambda: _construct(spec, policy_class, seed=0), seed
        )
    policy: Policy = _construct(spec, policy_class, seed)
    return policy


def _construct(spec: str, policy_class: type[Any], seed: int) -> Any:  # noqa: ANN401
    if is_url(spec):
        return policy_class(spec, seed=seed)
    return policy_class(seed=seed) if "seed" in parameters_of(policy_class) else policy_class()


def _module(spec: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except MissingDependencyError:
        raise
    except (Exception, SystemExit) as error:
        hint = ""
        if isinstance(error, ModuleNotFoundError) and error.name == name.partition(".")[0]:
            here = ", ".join(sorted(path.stem for path in Path.cwd().glob("*.py"))) or "none"
            hint = f"; modules in {str(Path.cwd())!r}: {here}"
        raise InvalidValueError(
            f"Policy {spec!r}: module {name!r} cannot be imported: {one_line(error)}{hint}."
        ) from error
