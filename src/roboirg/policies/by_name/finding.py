"""Find a policy by its name, or make one known that Python code hands over."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import (
    BUILT_IN,
    ELSEWHERE,
    HANDS,
    PRIVILEGED,
    SCRIPTED,
    UNKNOWN_VERSION,
    Asker,
    Place,
    PolicyRef,
)
from roboirg.core.versions import POLICY, Makeup, makeup_text
from roboirg.policies.by_name.policy_classes import find_class
from roboirg.policies.by_name.policy_kinds import (
    CLASS,
    LISTENER,
    LIVE,
    PLANNER,
    find_kind,
    known_kinds,
    live,
    maker_of,
    split_spec,
    system_of,
)
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.contract_check import check_policy
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.contract.policy_version import content_of, file_fingerprint, read_version
from roboirg.policies.planners import OF_MODELS, make_planner
from roboirg.policies.planners.planner_alone import PlannerAlone
from roboirg.policies.planners.systems import System


@dataclass(frozen=True)
class Privileged:
    """Declares that a policy may read the simulator's state: its ``attach`` gets the environment.

    Attributes:
        policy: a spec, class or object.
    """

    policy: str | type[Any] | object


def read_policy(spec: str, name: str | None = None) -> PolicyRef:
    """Return the policy of a spec. Code of ours is asked what it needs; no other is imported.

    Args:
        spec: a name in `BUILTIN`, such as ``oracle``; ``package.module:Class``; a URL; or one of
            `roboirg.policies.by_name.policy_kinds`.
        name: in records; the spec by default.

    Raises:
        UnknownNameError: there is no such built-in policy, scheme or option.
        InvalidValueError: an option or the URL is malformed, or a policy of ours is declared
            privileged.
        MissingDependencyError: a library that the URL's scheme needs is not installed.
    """
    ref = split_spec(spec if name is None else name, spec)
    system, kind = system_of(ref.kind, ref.target, dict(ref.options)), ref.kind
    is_foreign = not known_kinds().get(kind, True) or (kind == CLASS and ":" in ref.body)
    is_split = False
    asks: Asker | None = "listener" if kind == LISTENER else None
    if system is not None:
        planner_kind = (system.planner or {}).get("kind")
        has_own_planner = ":" in str(planner_kind)  # package.module:Class
        is_split = has_own_planner and system.policy == SCRIPTED
        has_hands = system.policy not in (SCRIPTED, ELSEWHERE)
        is_foreign = has_own_planner or (has_hands and read_policy(system.policy).is_foreign)
        asks = "planner" if planner_kind in OF_MODELS else None
    ref = replace(ref, asks=asks, is_foreign=is_foreign, is_privileged=ref.is_declared)
    if ref.is_declared and not is_foreign:
        raise InvalidValueError(
            f"Policy {ref.body!r} is not a class of your own; leave out {PRIVILEGED!r}."
        )
    if is_foreign:
        place: Place = "world" if ref.is_declared else "split" if is_split else "own"
        ref = replace(ref, is_privileged=ref.is_declared or is_split)
    else:
        ref = look_up(ref)
        place = "server" if is_url(spec) else "world"
        if find_kind(kind).has_weights:
            # What acts on the world by its state is next to it, even if it is trained.
            place = "world" if ref.is_privileged else "own"
    ref = replace(ref, place=place)
    return replace(ref, makeup=_makeup(ref, system))


def _makeup(ref: PolicyRef, system: System | None) -> Makeup:
    """Return what a policy is, with its place and version known, and the system that it names.

    Of code of others, every option that is typed counts.
    """
    maker = ref.kind
    if ref.kind in (BUILT_IN, CLASS):
        maker = ref.spec
    elif ref.version == UNKNOWN_VERSION and ref.place != "server":
        maker += f":{content_of(ref.target)}"
    options: dict[str, Any] = dict(ref.options)
    hands = SCRIPTED
    made: Any = None
    if system is not None:
        if system.planner is None:
            return read_policy(system.policy).makeup
        options = dict(system.planner)
        hands = system.policy
        kind = options.pop("kind", "")
        maker = f"{PLANNER}:{kind}"
        if ":" not in kind:  # else it is the user's own, which has no options
            made = make_planner(kind, options, maker)
    elif not ref.is_foreign:
        hands = options.pop(HANDS, SCRIPTED)
        made = maker_of(ref)(0)
    if hasattr(made, "options"):
        options = made.options.model_dump(exclude_defaults=True)
        options |= options.pop("model", {})  # its model's options stand next to its own
    if hands not in (SCRIPTED, ELSEWHERE):
        options[HANDS] = makeup_text(read_policy(hands).makeup)
    pairs = [(name, content_of(str(value))) for name, value in sorted(options.items())]
    return ((POLICY, maker), *pairs)


def policy_of(policy: str | type[Any] | object, name: str | None = None) -> PolicyRef:
    """Return the policy that Python code hands over.

    Args:
        policy: a spec; a class; an object; or any of them as `Privileged`. An object, and a class
            that cannot be imported elsewhere, plays in this process only; nothing but an object's
            own ``reset`` clears what it remembers.
        name: in records; the spec, or the name of the class, by default.
    """
    declaration = PRIVILEGED if isinstance(policy, Privileged) else ""
    given = policy.policy if isinstance(policy, Privileged) else policy
    if isinstance(given, str):
        return read_policy(declaration + given, name)
    kind = given if isinstance(given, type) else type(given)
    name = name or kind.__name__
    if given is kind and _can_be_imported(kind):
        return read_policy(f"{declaration}{kind.__module__}:{kind.__name__}", name)
    check_policy(name, given, ("reset", "act"))
    live[name] = given
    ref = split_spec(name, f"{declaration}{LIVE}:{name}")
    makeup = ((POLICY, f"{declaration}{kind.__module__}:{kind.__qualname__}"),)
    return replace(
        ref, place="python", is_foreign=True, is_privileged=ref.is_declared, makeup=makeup
    )


def make_policy(policy: str | PolicyRef, seed: int) -> Policy:
    """Make a policy.

    Args:
        policy: or its spec, as in `read_policy`. A class is called with ``seed=`` if it takes it,
            else without arguments.
        seed: of the policy's own random choices.

    Raises:
        UnknownNameError: there is no such built-in policy, scheme or option.
        InvalidValueError: the module or class cannot be imported or is not a policy, it has
            ``attach`` and is not declared privileged, or the URL is malformed.
        MissingDependencyError: a library that the URL's scheme needs is not installed.
    """
    ref = read_policy(policy) if isinstance(policy, str) else policy
    made = maker_of(ref)(seed)
    _refuse_undeclared(ref, made)
    return made


def find_policy(spec: str) -> PolicyRef:
    """Return a policy with what its class declares; its module is imported.

    Raises:
        UnknownNameError, InvalidValueError, MissingDependencyError: as `make_policy`.
    """
    return look_up(read_policy(spec))


def look_up(ref: PolicyRef) -> PolicyRef:
    """Return a policy with what its code declares, without opening it; raises like `find_policy`.

    Of code of others, the version is a fingerprint of the file that defines it.
    """
    if ref.kind in (CLASS, BUILT_IN):
        return declared_by(ref, find_class(ref.body))
    return declared_by(ref, live[ref.target] if ref.kind == LIVE else maker_of(ref)(0))


def declared_by(ref: PolicyRef, declaring: object) -> PolicyRef:
    """Return a policy with what its class, or one that was made, declares."""
    _refuse_undeclared(ref, declaring)
    if ref.kind == BUILT_IN:
        version: str | None = BUILT_IN
    else:
        version = file_fingerprint(declaring) if ref.is_foreign else read_version(declaring)
    return replace(
        ref,
        needs=PolicyNeeds.of(declaring),
        version=version or UNKNOWN_VERSION,
        is_privileged=ref.is_privileged or (not ref.is_foreign and hasattr(declaring, "attach")),
    )


def _refuse_undeclared(ref: PolicyRef, made: object) -> None:
    """Raise if a policy of others has ``attach``, which its spec does not declare."""
    # With scripted hands the whole has attach; the planner, which is all that is foreign, must not.
    is_planner = ref.place == "split" or isinstance(made, PlannerAlone)
    part = getattr(made, "planner", None) if is_planner else made
    if ref.is_foreign and not ref.is_declared and hasattr(part, "attach"):
        raise InvalidValueError(
            f"Policy {ref.spec!r} has attach(), with which a policy reads the simulator's state; "
            f"declare that as {PRIVILEGED + ref.spec!r}, in Python with roboirg.Privileged(policy),"
            " or remove attach()."
        )


def _can_be_imported(policy: type[Any]) -> bool:
    """Return whether a process of its own finds the class under its name."""
    module = policy.__module__
    return (
        module != "__main__" and getattr(sys.modules.get(module), policy.__name__, None) is policy
    )
