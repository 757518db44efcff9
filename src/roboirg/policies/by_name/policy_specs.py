"""Make policies from specs with a kind, such as ``system:…``, on the command line.

| spec | meaning |
| --- | --- |
| ``system:NAME?server=host:port&vlm=URL`` | a system of the paper, or of a file |
| ``planner:KIND?hands=scripted&model=NAME`` | a planner, and the scripted expert as its hands |
| ``planner:package.module:Class?hands=scripted`` | a planner of the user's own |
| ``vlm-listener:PROVIDER?model=NAME&base_url=URL`` | a model names the goal |

Installed packages add kinds through entry points of the group ``roboirg.policy_kinds``: an entry
point has the name of the kind, and names a `PolicyKind` or a module with one as ``KIND``.

Values that contain ``&`` or ``#`` are percent-encoded.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies.by_name.policy_classes import KINDS_GROUP, make_planner_of_class
from roboirg.policies.contract.base import Policy
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.contract.policy_urls import parse_query
from roboirg.policies.planners.planner_alone import PlannerAlone
from roboirg.policies.vlm.models import ModelOptions
from roboirg.policies.vlm.vlm_listener import ListenerOptions, VLMListener
from roboirg.util.discovery import entry_names, find_entry

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

SYSTEM = "system"
PLANNER = "planner"
LISTENER = "vlm-listener"
PRIVILEGED = "privileged:"
"""Before the spec of a foreign policy: the user lets it read the simulator's state."""
PolicyMaker = Callable[[int], Policy]
"""Makes a policy from a seed, without network or the libraries of providers."""


class PolicyKind(NamedTuple):
    """One kind of spec.

    Attributes:
        name: what stands before the colon.
        read: returns what makes the policies of a spec. It is called with the whole spec, with what
            stands between the colon and the question mark, and with the options behind that.
        has_weights: whether its policies are trained networks, which get a process of their own.
    """

    name: str
    read: Callable[[str, str, Mapping[str, str]], PolicyMaker]
    has_weights: bool = False


class PolicyFactory:
    """Makes policies, and has the attributes of a class of such policies.

    Args:
        spec: names the policies.
        make: makes a policy from a seed.
        sample: a policy that `make` made.
    """

    def __init__(self, spec: str, make: PolicyMaker, sample: Policy) -> None:
        self.spec, self._make = spec, make
        self.__name__ = spec
        PolicyNeeds.of(sample).declare_on(self)
        self.version = str(getattr(sample, "version", "unknown"))

    def __call__(self, seed: int = 0) -> Policy:
        """Make a fresh policy."""
        return self._make(seed)


class PrivilegedPolicyFactory(PolicyFactory):
    """Makes privileged policies; having ``attach`` declares it."""

    def attach(self, env: RoboIRGEnv) -> None:
        """Raise TypeError: only the policies themselves can be attached."""
        raise TypeError(f"{self.spec} makes policies; call attach({env}) on one of them.")


def find_policy_factory(spec: str) -> PolicyFactory | None:
    """Return the factory of a spec; None if the spec is of another kind.

    Needs neither a network nor a provider's client library.
    """
    kind, colon, rest = spec.partition(":")
    found = find_kind(kind) if colon else None
    if found is None:
        return None
    name, _, query = rest.partition("?")
    make = found.read(spec, name, parse_query(spec, query))
    sample = make(0)
    factory = PrivilegedPolicyFactory if hasattr(sample, "attach") else PolicyFactory
    return factory(spec, make, sample)


def _system(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    from roboirg.policies.by_name.systems import build_system, find_system

    if not name:
        raise InvalidValueError(f"Policy {spec!r} names no system.")
    system = find_system(name, options)
    return lambda seed: build_system(system, seed, make_follower)


def _planner(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes planners with hands; its model's options stand next to its own."""
    from roboirg.policies.by_name.systems import HANDS, SCRIPTED, System, build_system

    if ":" in name:
        return _planner_of_class(spec, name, options)
    of_model = {key: value for key, value in options.items() if key in ModelOptions.model_fields}
    own: dict[str, Any] = {key: value for key, value in options.items() if key not in of_model}
    hands = own.pop(HANDS, SCRIPTED)
    if of_model:
        own["model"] = of_model
    planner = {"kind": name, **own}
    system = System(name=f"{PLANNER}:{name}", about="", policy=hands, planner=planner)
    return lambda seed: build_system(system, seed, make_follower)


def _planner_of_class(spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes planners of a class with hands, or without."""
    from roboirg.policies.by_name.systems import ELSEWHERE, HANDS, SCRIPTED
    from roboirg.policies.planners.hierarchical_policy import with_planner

    if others := sorted(options.keys() - {HANDS}):
        raise UnknownNameError(f"option of {spec}:", others[0], [HANDS])
    hands = options.get(HANDS, SCRIPTED)

    def make(seed: int) -> Policy:
        planner = make_planner_of_class(name, seed)
        if hands == ELSEWHERE:
            if hasattr(planner, "attach"):
                raise undeclared_error(f"{PLANNER}:{name}")
            return PlannerAlone(planner)
        return with_planner(planner, make_follower(hands, seed), f"{PLANNER}:{name}")

    return make


def make_follower(spec: str, seed: int) -> Policy:
    """Make what follows a planner: a policy of an installed kind or a class, or scripted hands.

    Nothing is connected.
    """
    from roboirg.policies.by_name.systems import make_hands

    name, colon, rest = spec.partition(":")
    kind = find_kind(name) if colon else None
    if kind is None:
        return make_hands(spec, seed)
    place, _, query = rest.partition("?")
    return kind.read(spec, place, parse_query(spec, query))(seed)


def undeclared_error(spec: str) -> InvalidValueError:
    """Return the error of a foreign policy that has ``attach``, which its spec does not declare."""
    return InvalidValueError(
        f"Policy {spec!r} has attach(), with which a policy reads the simulator's state; "
        f"declare that as {PRIVILEGED + spec!r}, in Python with roboirg.Privileged(policy), or "
        "remove attach()."
    )


def _listener(_spec: str, name: str, options: Mapping[str, str]) -> PolicyMaker:
    """Return what makes VLM listeners; its options and its model's stand side by side."""
    own = [option for option in ListenerOptions.model_fields if option != "model"]
    of_model = [option for option in ModelOptions.model_fields if option != "provider"]
    for option in options:
        if option not in (*own, *of_model):
            raise UnknownNameError(f"option of {LISTENER}:", option, [*own, *of_model])
    values: dict[str, Any] = {key: value for key, value in options.items() if key in own}
    model: dict[str, Any] = {key: value for key, value in options.items() if key not in own}
    origin = f"policy {LISTENER}:{name}"
    values["model"] = check_options(ModelOptions, {"provider": name, **model}, origin)
    checked = check_options(ListenerOptions, values, origin)
    return lambda seed: VLMListener(checked, seed)


OURS = (
    PolicyKind(SYSTEM, _system),
    PolicyKind(PLANNER, _planner),
    PolicyKind(LISTENER, _listener),
)


@functools.cache
def find_kind(name: str) -> PolicyKind | None:
    """Return the kind of a name; None if there is none. Other kinds are not imported."""
    ours = {kind.name: kind for kind in OURS}
    return ours.get(name) or find_entry(name, "KIND", PolicyKind, KINDS_GROUP)


@functools.cache
def comes_with_us(name: str) -> bool:
    """Return whether a kind is our own code, and not that of another package."""
    return name in entry_names(KINDS_GROUP, package="roboirg") or name in {one.name for one in OURS}
