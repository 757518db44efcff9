"""How a name on the command line becomes a policy."""

from __future__ import annotations

import hashlib
import importlib
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from roboirg.actions import JOINT_ANGLE, ActionSpace, find_action_space
from roboirg.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.observations import (
    CAMERAS,
    DemonstrationFrames,
    check_cameras,
    check_demonstration_frames,
    check_observe_every,
)
from roboirg.policies.base import Policy
from roboirg.policies.urls import is_url

BUILTIN: Mapping[str, str] = {
    "oracle": "roboirg.policies.oracle:OraclePolicy",
    "listener": "roboirg.policies.listeners:ListenerPolicy",
    "forgetful": "roboirg.policies.listeners:ForgetfulPolicy",
    "random": "roboirg.policies.random:RandomPolicy",
}

SCHEMES: Mapping[str, str] = {
    "openpi": "roboirg.policies.remote.openpi:OpenpiPolicy",
    "mme-vla": "roboirg.policies.remote.mme_vla:MmeVlaPolicy",
    "challenge": "roboirg.policies.remote.challenge:ChallengePolicy",
    "challenge+http": "roboirg.policies.remote.challenge:ChallengeHttpPolicy",
    "lerobot": "roboirg.policies.lerobot:LeRobotPolicy",
}
"""Policies named by a URL, by its scheme: classes made with ``(url, seed=)``, without a network."""

FINGERPRINT_LENGTH = 12
"""Hexadecimal digits."""


def load_policy_class(spec: str) -> type[Any]:
    """The class that a spec names: a built-in name, ``package.module:Class``, or a URL.

    Of ``system:NAME`` and ``vlm-listener:PROVIDER`` (`roboirg.policies.planning.specs`) something
    that makes policies and has a class's attributes.

    Raises:
        UnknownNameError: it is none of them, or the URL gives an option that there is not.
        InvalidValueError: the module or the class cannot be imported, or is not a policy; or
            the URL is malformed.
    """
    if ":" in spec:
        from roboirg.policies.planning import specs  # which loads policies itself

        factory = specs.find(spec)
        if factory is not None:
            return cast("type[Any]", factory)  # it has all that is asked of a class here
    if is_url(spec):
        policy_class = _url_class(spec)
        _check_wishes(spec, policy_class(spec))
        return policy_class
    if spec not in BUILTIN and ":" not in spec:
        raise UnknownNameError("policy", spec, [*BUILTIN, "package.module:Class", *_examples()])
    module_name, _, name = BUILTIN.get(spec, spec).partition(":")
    module = _module(spec, module_name)
    if not hasattr(module, name):
        raise InvalidValueError(f"Policy {spec!r}: module {module_name} has no class {name!r}.")
    found = getattr(module, name)
    if not inspect.isclass(found):
        raise InvalidValueError(
            f"Policy {spec!r}: {name!r} in module {module_name} is no class but of type "
            f"{type(found).__name__}."
        )
    _check_class(spec, found)
    return found


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
    policy_class = load_policy_class(spec)
    if is_url(spec):
        remote: Policy = policy_class(spec, seed=seed)
        return remote
    policy: Policy = policy_class(seed=seed) if "seed" in _takes(policy_class) else policy_class()
    return policy


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


def wanted_cameras(policy: object) -> tuple[str, ...]:
    """The pictures that a policy, or a class of policies, asks for.

    Raises:
        InvalidValueError: its ``cameras`` are not different names of cameras in a tuple or list.
    """
    return check_cameras(getattr(policy, "cameras", CAMERAS))


def wanted_actions(policy: object) -> ActionSpace:
    """The action space in which a policy, or a class of policies, gives its actions.

    Raises:
        UnknownNameError: its ``actions`` name none.
    """
    return find_action_space(getattr(policy, "actions", JOINT_ANGLE.name))


def wanted_demonstration_frames(policy: object) -> DemonstrationFrames:
    """The pictures of the video that a policy, or a class of policies, asks for.

    Raises:
        InvalidValueError: its ``demonstration_frames`` are neither all, none nor every n-th.
    """
    return check_demonstration_frames(getattr(policy, "demonstration_frames", "all"))


def wanted_history(policy: object) -> int | None:
    """After how many control steps a policy, or a class of policies, wants to look.

    Raises:
        InvalidValueError: its ``observe_every`` is neither None nor a number of control steps.
    """
    return check_observe_every(getattr(policy, "observe_every", None))


def wanted_history_cameras(policy: object) -> tuple[str, ...] | None:
    """The pictures that a policy, or a class of policies, wants in the history.

    Returns:
        None for all that it wants of the present.

    Raises:
        InvalidValueError: its ``history_cameras`` are not different names of cameras.
    """
    chosen = getattr(policy, "history_cameras", None)
    return None if chosen is None else check_cameras(chosen)


_WISHES: Mapping[str, Callable[[object], object]] = {
    "cameras": wanted_cameras,
    "actions": wanted_actions,
    "demonstration_frames": wanted_demonstration_frames,
    "observe_every": wanted_history,
    "history_cameras": wanted_history_cameras,
}


def _check_class(spec: str, policy_class: type[Any]) -> None:
    """Complain of what would otherwise end every episode."""
    name = policy_class.__name__
    for method in ("reset", "act"):
        if not hasattr(policy_class, method):
            raise InvalidValueError(f"Policy {spec!r}: class {name} has no method {method}().")
        if not callable(getattr(policy_class, method)):
            raise InvalidValueError(f"Policy {spec!r}: {method} of class {name} is no method.")
    if inspect.isabstract(policy_class):
        lacking = sorted(policy_class.__abstractmethods__)
        raise InvalidValueError(
            f"Policy {spec!r}: class {name} is abstract; it lacks {', '.join(lacking)}."
        )
    for parameter in _takes(policy_class).values():
        optional = parameter.default is not parameter.empty or parameter.kind in (
            parameter.VAR_POSITIONAL,
            parameter.VAR_KEYWORD,
        )
        if not optional and parameter.name != "seed":
            raise InvalidValueError(
                f"Policy {spec!r}: {name}() is called with seed= at most, but needs "
                f"{parameter.name!r}; give it a default."
            )
    _check_wishes(spec, policy_class)


def _check_wishes(spec: str, policy: object) -> None:
    """Complain of what a class, or a policy, asks for."""
    for attribute, wanted in _WISHES.items():
        # What a property of a class says is known when there is an object.
        if not inspect.isclass(policy) or not hasattr(
            inspect.getattr_static(policy, attribute, ()), "__get__"
        ):
            try:
                wanted(policy)
            except InvalidValueError as error:
                raise InvalidValueError(f"Policy {spec!r}: {error}") from error


def _url_class(spec: str) -> type[Any]:
    """The class of a URL's scheme."""
    scheme = spec.partition("://")[0]
    if scheme not in SCHEMES:
        raise UnknownNameError("policy scheme", scheme, SCHEMES)
    module_name, _, name = SCHEMES[scheme].partition(":")
    found: type[Any] = getattr(_module(spec, module_name), name)
    return found


def _examples() -> list[str]:
    return [*(f"{scheme}://…" for scheme in SCHEMES), "system:NAME", "vlm-listener:PROVIDER"]


def _takes(policy_class: type[Any]) -> Mapping[str, inspect.Parameter]:
    try:
        return inspect.signature(policy_class).parameters
    except (TypeError, ValueError):  # a class written in C need not tell
        return {}


def _module(spec: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except MissingDependencyError:
        raise
    except (Exception, SystemExit) as error:
        words = " ".join(f"{type(error).__name__}: {error}".split())
        raise InvalidValueError(
            f"Policy {spec!r}: module {name!r} cannot be imported ({words})."
        ) from error
