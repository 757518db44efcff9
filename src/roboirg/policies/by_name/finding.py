"""Find a policy by its name, or make one known that Python code hands over.

- A *spec* is the name on the command line, ``oracle`` or ``planner:gemini?hands=scripted``
  (`roboirg.policies.by_name.policy_kinds`).
- A *reference* (`PolicyRef`) is what is known of the policy before it is made: where it runs, what
  it needs.
- *Hands* are what follows the subgoals of a planner: a policy, or the scripted expert, which needs
  the simulator.
- A policy is *foreign* if its code is neither ours nor behind a protocol; it gets a process of its
  own.
- Its *makeup* is what distinguishes it from others of its name: its code and its options, as pairs
  of text (`roboirg.core.versions`).
"""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass, replace
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import (
    BEHIND,
    BUILT_IN,
    ELSEWHERE,
    HANDS,
    PRIVILEGED,
    RESOLVE,
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
    namer_of,
    split_spec,
    system_of,
)
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.contract_check import check_policy
from roboirg.policies.contract.goal_naming import GoalNamer
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.contract.policy_version import content_of, file_fingerprint, read_version
from roboirg.policies.planners import OF_MODELS, make_planner
from roboirg.policies.planners.planner_alone import PlannerAlone
from roboirg.policies.planners.systems import System
from roboirg.policies.resolving.resolving_policy import ResolvingPolicy, rewritten_version
from roboirg.policies.resolving.rewriting import Rewriting, read_rewriting


@dataclass(frozen=True)
class Privileged:
    """Declares that a policy may read the simulator's state: its ``attach`` gets the environment.

    Attributes:
        policy: a spec, class or object.
    """

    policy: str | type[Any] | object


def read_policy(spec: str, name: str | None = None) -> PolicyRef:
    """Return a reference to the policy of a spec.

    Code of ours is imported and asked what it needs; that of users is not. ``oracle`` gives a
    reference of the kind `BUILT_IN` that runs in the simulator's process and is privileged.

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
    if ref.kind == RESOLVE:
        return _read_rewritten(ref)
    system = system_of(ref.kind, ref.target, dict(ref.options))
    ref = _with_code(ref, system)
    if ref.is_declared and not ref.is_foreign:
        raise InvalidValueError(
            f"Policy {ref.body!r} is not a class of your own; leave out {PRIVILEGED!r}."
        )
    if not ref.is_foreign:
        ref = look_up(ref)
        ref = replace(ref, place=_place_of_ours(ref))
    elif ref.is_declared:
        ref = replace(ref, place="world", is_privileged=True)
    elif ref.place == "split":
        ref = replace(ref, is_privileged=True)  # its scripted hands read the world
    return replace(ref, makeup=_makeup(ref, system))


def rewriting_in(ref: PolicyRef) -> Rewriting:
    """Return what a policy behind a rewriter combines: the namer, and the spec of the policy."""
    return read_rewriting(ref.spec, ref.target, dict(ref.options))


@functools.lru_cache(maxsize=16)
def follower_of(ref: PolicyRef) -> PolicyRef:
    """Return the policy behind a rewriter; it is read once in a process, as each episode asks."""
    return read_policy(rewriting_in(ref).policy)


def _read_rewritten(ref: PolicyRef) -> PolicyRef:
    """Return a policy behind a rewriter, read like `read_policy` from what its spec combines.

    The rewriter plays next to the world, whose task it knows; the policy where it plays alone.
    """
    if ref.is_declared:
        raise InvalidValueError(
            f"Policy {ref.spec!r} is not a class of your own; write {PRIVILEGED!r} before the "
            "policy that it names, if that is one."
        )
    rewriting = rewriting_in(ref)
    follower = read_policy(rewriting.policy)
    namer = namer_of(rewriting, 0)
    options = _changed_options(namer, dict(rewriting.options))
    options[BEHIND] = makeup_text(follower.makeup)
    if rewriting.wordings is not None:
        options["wordings"] = rewriting.wordings
    is_asked = rewriting.namer.partition(":")[0] == LISTENER
    ref = replace(
        ref,
        is_foreign=follower.is_foreign,
        asks="listener" if is_asked else follower.asks,
        place="behind" if follower.is_hosted else follower.place,
        makeup=_joined(f"{RESOLVE}:{rewriting.namer}", options, SCRIPTED),
    )
    return behind_rewriter(ref, namer, follower)


def behind_rewriter(ref: PolicyRef, namer: GoalNamer, follower: PolicyRef) -> PolicyRef:
    """Return a policy behind a rewriter with what namer and policy declare together.

    Args:
        ref: of the whole.
        namer: of the rewriter.
        follower: of the policy behind the rewriter, as far as it is known now.
    """
    needs = follower.needs
    if needs is not None:
        needs = needs.merge(PolicyNeeds.of_planner(namer))
    version = UNKNOWN_VERSION
    if follower.version != UNKNOWN_VERSION:
        version = rewritten_version(namer, follower)
    return replace(
        ref,
        needs=needs,
        version=version,
        problem=follower.problem,
        is_privileged=follower.is_privileged or hasattr(namer, "attach"),
    )


def _with_code(ref: PolicyRef, system: System | None) -> PolicyRef:
    """Return a reference with what the spec says of the policy's code, without importing it.

    Set are ``is_foreign`` (whether the code, or a part of it, is a user's), ``asks`` (which part of
    it asks a model, if any) and ``place`` (where it plays, which holds for foreign code only).

    Args:
        ref: of the policy.
        system: the planner and hands that its spec means; None if it means no such pair.
    """
    place: Place = "own"
    asks: Asker | None = None
    if system is None:
        is_class = ref.kind == CLASS and ":" in ref.body  # package.module:Class
        is_foreign = is_class or not known_kinds().get(ref.kind, True)
        if ref.kind == LISTENER:
            asks = "listener"
    else:
        is_foreign = ":" in system.planner_kind  # package.module:Class
        if is_foreign and system.policy == SCRIPTED:
            place = "split"  # scripted hands need the simulator, foreign code must not be near it
        if system.policy not in (SCRIPTED, ELSEWHERE):
            is_foreign = is_foreign or read_policy(system.policy).is_foreign
        if system.planner_kind in OF_MODELS:
            asks = "planner"
    return replace(ref, is_foreign=is_foreign, asks=asks, place=place)


def _place_of_ours(ref: PolicyRef) -> Place:
    """Return where a policy with code of ours runs: in the simulator's process, or elsewhere.

    Trained networks get a process of their own (``own``), and URLs mean a ``server``. The reference
    comes from `look_up`, which finds out whether the policy is privileged.
    """
    if find_kind(ref.kind).has_weights:
        # What acts on the world by its state is next to it, even if it is trained.
        return "world" if ref.is_privileged else "own"
    return "server" if is_url(ref.spec) else "world"


def _makeup(ref: PolicyRef, system: System | None) -> Makeup:
    """Return the makeup of a policy: what makes it, and its options, as pairs of names and values.

    ``planner:gemini?model=m1`` -> ``(("policy", "planner:gemini"), ("model", "m1"))``. Options that
    have their default values are left out, as they make no difference; of foreign code, whose
    defaults are not known, every option that is typed is kept.

    Args:
        ref: of the policy, with place and version.
        system: that its spec means, if any.
    """
    if system is not None:
        return _makeup_of_system(system)
    maker = ref.kind
    if ref.kind in (BUILT_IN, CLASS):
        maker = ref.spec
    elif ref.version == UNKNOWN_VERSION and ref.place != "server":
        # Without a version, only the content of its file distinguishes it from others.
        maker = f"{ref.kind}:{content_of(ref.target)}"
    options = dict(ref.options)
    if ref.is_foreign:
        return _joined(maker, options, SCRIPTED)
    hands = options.pop(HANDS, SCRIPTED)
    options = _changed_options(maker_of(ref)(0), options)
    return _joined(maker, options, hands)


def _makeup_of_system(system: System) -> Makeup:
    """Return the makeup of a planner with its hands; without a planner that of the policy alone.

    ``planner:gemini?model=m1`` -> ``(("policy", "planner:gemini"), ("model", "m1"))``.
    """
    if system.planner is None:
        return read_policy(system.policy).makeup
    kind = system.planner_kind
    maker = f"{PLANNER}:{kind}"
    options = system.planner_options
    if ":" not in kind:  # else it is the user's own, which has no options
        options = _changed_options(make_planner(kind, options, maker), options)
    return _joined(maker, options, system.policy)


def _changed_options(made: Any, typed: dict[str, Any]) -> dict[str, Any]:  # noqa: ANN401
    """Return the options of a policy or planner that differ from their defaults.

    Options of its model stand next to its own, as they are typed: ``{"asked": "when-done",
    "temperature": 1.0}``.

    Args:
        made: the policy or planner.
        typed: its options as typed, which are returned if it keeps no ``options`` of its own.
    """
    if not hasattr(made, "options"):
        return typed
    options: dict[str, Any] = made.options.model_dump(exclude_defaults=True)
    of_model: dict[str, Any] = options.pop("model", {})
    return options | of_model


def _joined(maker: str, options: dict[str, Any], hands: str) -> Makeup:
    """Return a makeup: the maker, then the options sorted by name, with the hands as one of them.

    ``planner:gemini`` with the option ``model`` gives ``(("policy", "planner:gemini"), ("model",
    "m1"))``. Hands are named only if they are neither the scripted ones nor elsewhere. Of an option
    that names a file, the value is a hash of the file's content.
    """
    if hands not in (SCRIPTED, ELSEWHERE):
        options = {**options, HANDS: makeup_text(read_policy(hands).makeup)}
    pairs = [(name, content_of(str(value))) for name, value in sorted(options.items())]
    return ((POLICY, maker), *pairs)


def policy_of(policy: str | type[Any] | object, name: str | None = None) -> PolicyRef:
    """Return a reference to the policy that Python code hands over.

    Args:
        policy: a spec; a class; an object; or any of them as `Privileged`. An object, and a class
            that cannot be imported elsewhere, plays in this process only, and is kept in `live`
            under its name; nothing but an object's own ``reset`` clears what it remembers.
        name: in records; the spec, or the name of the class, by default.
    """
    declaration = ""
    given = policy
    if isinstance(policy, Privileged):
        declaration = PRIVILEGED
        given = policy.policy
    if isinstance(given, str):
        return read_policy(declaration + given, name)

    policy_class = given if isinstance(given, type) else type(given)
    name = name or policy_class.__name__
    module = policy_class.__module__
    if given is policy_class and _can_be_imported(policy_class):
        return read_policy(f"{declaration}{module}:{policy_class.__name__}", name)

    # It cannot be named elsewhere, so the object or class itself is kept under its name.
    check_policy(name, given, ("reset", "act"))
    live[name] = given
    ref = split_spec(name, f"{declaration}{LIVE}:{name}")
    return replace(
        ref,
        place="python",
        is_foreign=True,
        is_privileged=ref.is_declared,
        makeup=((POLICY, f"{declaration}{module}:{policy_class.__qualname__}"),),
    )


def make_policy(policy: str | PolicyRef, seed: int) -> Policy:
    """Make a policy that can play; it is not yet attached to an environment.

    Args:
        policy: its reference, or its spec as in `read_policy`. A class is called with ``seed=`` if
            it takes it, else without arguments.
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
    """Return a reference to the policy of a spec with what its class declares; imports its module.

    Raises:
        UnknownNameError, InvalidValueError, MissingDependencyError: as `make_policy`.
    """
    return look_up(read_policy(spec))


def look_up(ref: PolicyRef) -> PolicyRef:
    """Return a reference with what the policy's code declares; raises like `find_policy`.

    A class is asked itself; where the spec names no class, a policy is made and asked, but not
    opened, so nothing is connected.
    """
    if ref.kind in (CLASS, BUILT_IN):
        declaring: object = find_class(ref.body)
    elif ref.kind == LIVE:
        declaring = live[ref.target]
    else:
        declaring = maker_of(ref)(0)
    return declared_by(ref, declaring)


def declared_by(ref: PolicyRef, declaring: object) -> PolicyRef:
    """Return a reference with the needs, version and privilege that the policy's code declares.

    Code of ours that has ``attach`` reads the simulator's state, so it is privileged; a user's has
    to be declared privileged in the spec, or `InvalidValueError` is raised.

    Args:
        ref: of the policy.
        declaring: its class, or a policy that was made.
    """
    _refuse_undeclared(ref, declaring)
    version: str | None
    if ref.kind == BUILT_IN:
        version = BUILT_IN
    elif ref.is_foreign:
        version = file_fingerprint(declaring)
    else:
        version = read_version(declaring)
    is_ours_with_attach = not ref.is_foreign and hasattr(declaring, "attach")
    if isinstance(declaring, ResolvingPolicy):
        is_ours_with_attach = declaring.is_privileged
    return replace(
        ref,
        needs=PolicyNeeds.of(declaring),
        version=version or UNKNOWN_VERSION,
        is_privileged=ref.is_privileged or is_ours_with_attach,
    )


def _refuse_undeclared(ref: PolicyRef, made: object) -> None:
    """Raise if foreign code can read the simulator's state, and its spec does not declare that.

    It can if it has ``attach``. The declaration is `PRIVILEGED` before the spec.

    Args:
        ref: of the policy.
        made: the policy, or its class.
    """
    foreign_part = made
    if isinstance(made, ResolvingPolicy):
        _refuse_undeclared(follower_of(ref), made.policy)
        return
    if ref.place == "split" or isinstance(made, PlannerAlone):
        # With scripted hands the whole has attach; the planner, which is all that is foreign, must
        # not.
        foreign_part = getattr(made, "planner", None)
    if ref.is_foreign and not ref.is_declared and hasattr(foreign_part, "attach"):
        raise InvalidValueError(
            f"Policy {ref.spec!r} has attach(), with which a policy reads the simulator's state; "
            f"declare that as {PRIVILEGED + ref.spec!r}, in Python with roboirg.Privileged(policy),"
            " or remove attach()."
        )


def _can_be_imported(policy_class: type[Any]) -> bool:
    """Return whether another process can import the class by its module and name.

    It cannot if the class is defined in the script that runs, or within a function.
    """
    if policy_class.__module__ == "__main__":
        return False
    module = sys.modules.get(policy_class.__module__)
    return getattr(module, policy_class.__name__, None) is policy_class
