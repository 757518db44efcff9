"""Kinds of policies: what the text before the colon of a spec means.

| spec | meaning |
| --- | --- |
| ``oracle`` | a built-in policy |
| ``package.module:Class`` | a class of the user's own |
| ``openpi://host:port?name=value`` | a policy on a server, or a checkpoint, by its scheme |
| ``system:NAME?server=host:port&vlm=URL`` | a system of the paper, or of a file |
| ``planner:KIND?hands=scripted&model=NAME`` | a planner, and the scripted expert as its hands |
| ``planner:package.module:Class?hands=scripted`` | a planner of the user's own |
| ``vlm-listener:PROVIDER?model=NAME&base_url=URL`` | a model names the goal |
| ``resolve:NAMER?policy=SPEC`` | a policy, and what rewrites the words that it hears |

Installed packages add kinds through entry points of the group ``roboirg.policy_kinds``: an entry
point has the name of the kind, and names a `PolicyKind` or a module with one as ``KIND``.

Values that contain ``&`` or ``#`` are percent-encoded.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, cast

from roboirg.core.error_words import OUR_PACKAGES
from roboirg.core.errors import UnknownNameError
from roboirg.core.policy_ref import (
    BUILT_IN,
    ELSEWHERE,
    HANDS,
    PRIVILEGED,
    RESOLVE,
    SCRIPTED,
    PolicyRef,
)
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.by_name.policy_classes import (
    CHECKPOINTS,
    KINDS_GROUP,
    find_class,
    make_from_class,
)
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.batch_policy import make_batched, takes_batches
from roboirg.policies.contract.goal_naming import GoalNamer
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import is_url, parse_query, split_url
from roboirg.policies.planners import make_planner
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.planners.planner import Planner
from roboirg.policies.planners.planner_alone import PlannerAlone
from roboirg.policies.planners.systems import System, find_system, with_options
from roboirg.policies.resolving.resolving_policy import ResolvingPolicy
from roboirg.policies.resolving.rewriting import OPTIONS, Rewriting, read_rewriting
from roboirg.policies.vlm.vlm_listener import ListenerOptions, VLMListener, VLMNamer
from roboirg.util.discovery import entry_names, find_entry

CLASS, LIVE, LISTENER, PLANNER, SYSTEM = "class", "live", "vlm-listener", "planner", "system"
"""Names of kinds; ``live`` is what Python code has handed over, in `live`."""
PolicyMaker = Callable[[int], Policy]
"""Makes a policy from a seed; it uses neither the network nor the libraries of model providers."""

SCRIPTED_HANDS_CLASS = "roboirg.policies.hands.scripted_hands:ScriptedHands"

live: dict[str, Any] = {}
"""Classes and objects that Python code of this process hands over, by the names of the policies."""


class PolicyKind(NamedTuple):
    """One kind of spec.

    Attributes:
        name: what stands before the colon.
        read: returns what makes the policies of a spec. For ``planner:gemini?model=m1`` it is
            called with the whole spec, with ``"gemini"``, and with ``{"model": "m1"}``.
        has_weights: whether its policies are trained networks, which get a process of their own.
        read_namer: called like `read`, returns what makes, from a seed, the part of its policies
            that names goals, for ``resolve:``; None if they have no such part.
    """

    name: str
    read: Callable[[str, str, Mapping[str, str]], PolicyMaker]
    has_weights: bool = False
    read_namer: Callable[[str, str, Mapping[str, str]], Callable[[int], GoalNamer]] | None = None


def split_spec(name: str, spec: str) -> PolicyRef:
    """Parse a spec; return a reference to its policy with kind, target and options, and no more.

    | spec | kind | target | options |
    | --- | --- | --- | --- |
    | ``planner:gemini?model=m1`` | ``planner`` | ``gemini`` | ``(("model", "m1"),)`` |
    | ``openpi://host:8000`` | ``openpi`` | ``host:8000`` | |
    | ``oracle`` | `BUILT_IN` | ``oracle`` | |
    | ``lab.walk:Walk`` | `CLASS` | ``lab.walk:Walk`` | |

    Nothing is imported. A spec of no known kind counts as a class, which need not exist.

    Args:
        name: in records.
        spec: of the policy; a URL, too.

    Raises:
        InvalidValueError: the options are malformed.
    """
    body = spec.removeprefix(PRIVILEGED)
    if is_url(body):
        return replace(split_url(body), name=name, spec=spec)
    kind, colon, rest = body.partition(":")
    if colon and kind in known_kinds():
        target, _, query = rest.partition("?")
        options = tuple(parse_query(body, query).items())
        return PolicyRef(name=name, spec=spec, kind=kind, target=target, options=options)
    kind = BUILT_IN if body in BUILTIN else CLASS
    return PolicyRef(name=name, spec=spec, kind=kind, target=body)


@functools.cache
def known_kinds() -> Mapping[str, bool]:
    """Return for the name of each kind whether its code is ours; imports none of them.

    ``{"planner": True, "their-kind": False, ...}``
    """
    are_ours = dict.fromkeys(entry_names(KINDS_GROUP), False)
    for name in (*OURS, *entry_names(KINDS_GROUP, OUR_PACKAGES)):
        are_ours[name] = True
    return are_ours


@functools.cache
def find_kind(name: str) -> PolicyKind:
    """Return the kind of policies with a name, such as ``planner``.

    Kinds of other packages are found through entry points, and only the named one is imported. Any
    other name is a kind whose policies a class makes: the scheme of a URL, or ``class`` itself.
    """
    found = OURS.get(name) or find_entry(name, "KIND", PolicyKind, KINDS_GROUP)
    return found or PolicyKind(name, _of_class, has_weights=name in CHECKPOINTS)


def maker_of(ref: PolicyRef) -> PolicyMaker:
    """Return the function that makes a policy from a seed; the policy's module is imported.

    Raises:
        UnknownNameError: there is no such policy, scheme or option.
        InvalidValueError: the module or class cannot be imported or is not a policy, or an option
            is malformed.
        MissingDependencyError: a library that it needs is not installed.
    """
    return find_kind(ref.kind).read(ref.body, ref.target, dict(ref.options))


def system_of(kind: str, target: str, options: Mapping[str, str]) -> System | None:
    """Return the planner and the hands that a spec combines; None if it names no planner.

    ``system:NAME`` is read from a file, which has both. In ``planner:KIND?hands=SPEC`` the option
    ``hands`` names the hands, by default the scripted ones, and all others are the planner's.

    Args:
        kind: of the policy, as in `split_spec`.
        target: name or file of the system, or kind of the planner.
        options: of the spec. A planner that is a class of the user's has none but ``hands``.
    """
    if kind == SYSTEM:
        return find_system(target, options)
    if kind != PLANNER:
        return None
    name = f"{PLANNER}:{target}"
    planner_options = dict(options)
    hands = planner_options.pop(HANDS, SCRIPTED)
    is_users_class = ":" in target
    if is_users_class and planner_options:
        raise UnknownNameError(f"option of {name}:", min(planner_options), [HANDS])
    planner = with_options({"kind": target}, planner_options)
    return System(name=name, policy=hands, planner=planner)


def make_follower(spec: str, seed: int) -> Policy:
    """Make the policy that follows a planner's subgoals; nothing is connected yet.

    Args:
        spec: of any policy, or `SCRIPTED` for the scripted hands.
        seed: of its own random choices.
    """
    import_path = SCRIPTED_HANDS_CLASS if spec == SCRIPTED else spec
    make = maker_of(split_spec(spec, import_path))
    return make(seed)


def namer_of(rewriting: Rewriting, seed: int) -> GoalNamer:
    """Make what names the goals of a rewriter, such as ``surface`` or ``vlm-listener:openai``.

    Raises:
        UnknownNameError: there is no such namer, or it has no such option.
    """
    # Imported here because it brings the reader's patterns, which other policies do not need.
    from roboirg.policies.resolving.goal_namers import OF_OURS, make_namer

    name = rewriting.namer
    if name in OF_OURS:
        if rewriting.options:
            raise UnknownNameError(f"option of {RESOLVE}:{name}:", min(rewriting.options), OPTIONS)
        return make_namer(name, seed)
    kind, _, target = name.partition(":")
    read = find_kind(kind).read_namer if kind in known_kinds() else None
    if read is None:
        raise UnknownNameError("namer", name, (*OF_OURS, f"{LISTENER}:PROVIDER", "learned:FILE"))
    return read(name, target, rewriting.options)(seed)


def put_behind(rewriting: Rewriting, policy: Policy, seed: int) -> ResolvingPolicy:
    """Return a policy behind a rewriter, whose namer is made now."""
    return ResolvingPolicy(namer_of(rewriting, seed), policy, rewriting.wordings)


def _build(system: System, seed: int) -> Policy:
    """Make the policy of a system: a planner with what follows it, as one policy.

    It is the low-level policy alone if the system has no planner, and the planner alone if the
    hands are in another process (`ELSEWHERE`).
    """
    if system.planner is None:
        return make_follower(system.policy, seed)
    kind = system.planner_kind
    if ":" in kind:
        planner_class = find_class(kind, ("reset", "plan"))
        planner = cast("Planner", make_from_class(kind, planner_class, seed))
    else:
        origin = f"the planner of system {system.name}"
        planner = make_planner(kind, system.planner_options, origin, seed)
    if system.policy == ELSEWHERE:
        return PlannerAlone(planner)
    return HierarchicalPolicy(planner, make_follower(system.policy, seed), system.name)


def _of_class(spec: str, _target: str, _options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes policies of the class that a spec names: ``lab.walk:Walk``, or a URL."""
    return functools.partial(make_from_class, spec, find_class(spec))


def _of_system(kind: str, _spec: str, target: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes the policies of ``system:NAME`` or ``planner:KIND``.

    Args:
        kind: which of the two.
        target: what stands after the colon.
        options: of the spec.
    """
    system = cast("System", system_of(kind, target, options))
    return functools.partial(_build, system)


def _of_listener(_spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes VLM listeners with a provider; raises for an unknown option."""
    return functools.partial(VLMListener, _listener_options(name, options))


def _of_namer(_spec: str, name: str, options: Mapping[str, str]) -> Callable[[int], GoalNamer]:
    """Return what makes the namers of VLM listeners; options are those of the listener."""
    checked = _listener_options(name, options)
    return lambda _seed: VLMNamer(checked)


def _listener_options(provider: str, options: Mapping[str, str]) -> ListenerOptions:
    """Return the checked options of a VLM listener and its model, which stand side by side."""
    values = with_options({}, {**options, "provider": provider})
    return check_options(ListenerOptions, values, f"policy {LISTENER}:{provider}")


def _of_rewriter(spec: str, target: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes policies behind a rewriter."""
    rewriting = read_rewriting(spec, target, options)
    make = maker_of(split_spec(rewriting.policy, rewriting.policy))
    return lambda seed: put_behind(rewriting, make(seed), seed)


def _of_process(spec: str, name: str, _options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes policies of an object or class that Python code has handed over.

    An object plays every episode itself; of a class, each episode gets a policy of its own.

    Args:
        spec: the whole of it, ``live:Mine``.
        name: under which `live` has the object or class.
        _options: none are possible.
    """
    found = live[name]
    if isinstance(found, type):
        return functools.partial(make_from_class, spec, found)
    if takes_batches(found):
        return functools.partial(make_batched, (spec, id(found)), lambda: found)
    return lambda _seed: found


OURS = {
    SYSTEM: PolicyKind(SYSTEM, functools.partial(_of_system, SYSTEM)),
    PLANNER: PolicyKind(PLANNER, functools.partial(_of_system, PLANNER)),
    LISTENER: PolicyKind(LISTENER, _of_listener, read_namer=_of_namer),
    RESOLVE: PolicyKind(RESOLVE, _of_rewriter),
    LIVE: PolicyKind(LIVE, _of_process),
}
