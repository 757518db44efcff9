"""What a policy is besides its version, wherever it is; nothing of others is imported for it.

An address and a path may change, and so may options that are `NOT_COMPARED`. All else makes another
policy. Of a kind in a package of others, everything that is typed does.
"""

from __future__ import annotations

from typing import Any

from roboirg.core.policy_ref import (
    BUILT_IN,
    CLASS,
    ELSEWHERE,
    HANDS,
    PRIVILEGED,
    SCRIPTED,
    UNKNOWN_VERSION,
    PolicyRef,
)
from roboirg.core.versions import POLICY, Makeup
from roboirg.policies.by_name.policy_classes import CHECKPOINTS
from roboirg.policies.by_name.policy_kinds import (
    LISTENER,
    PLANNER,
    find_kind,
    known_kinds,
    maker_of,
    split_spec,
    system_of,
)
from roboirg.policies.contract.option_checking import content_of, told_apart
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.planners import make_planner
from roboirg.policies.planners.systems import System


def makeup_of(ref: PolicyRef) -> Makeup:
    """Return what a policy is; raises like `roboirg.policies.by_name.finding.read_policy`."""
    system = system_of(ref.kind, ref.target, dict(ref.options))
    if system is not None:
        if system.planner is None:
            return makeup_of(split_spec(ref.name, system.policy))
        found = _of_planner(system, dict(system.planner))
    elif ref.kind in (BUILT_IN, CLASS):
        found = {POLICY: ref.target}
    elif is_url(ref.body) or ref.kind == LISTENER:
        found = _of_client(ref)
    else:
        found = _of_kind(ref)
    maker = found.pop(POLICY)
    if ref.is_declared:
        maker = PRIVILEGED + maker
    return ((POLICY, maker), *sorted(found.items()))


def _of_planner(system: System, options: dict[str, Any]) -> dict[str, str]:
    kind = str(options.pop("kind", ""))
    found = {POLICY: f"{PLANNER}:{kind}"}
    if ":" not in kind:  # else it is the user's own, which has no options
        planner: Any = make_planner(kind, options, f"the planner of system {system.name}")
        found |= told_apart(planner.options)
    return found | _of_hands(system.policy)


def _of_hands(spec: str) -> dict[str, str]:
    """Return what the policy behind a planner is, under names of its own."""
    if spec in (SCRIPTED, ELSEWHERE):
        return {}
    makeup = dict(makeup_of(split_spec(spec, spec)))
    found = {HANDS: makeup.pop(POLICY)}
    for name, value in makeup.items():
        found[f"{HANDS}.{name}"] = value
    return found


def _of_client(ref: PolicyRef) -> dict[str, str]:
    """Return what a policy on a server, a checkpoint or a model is, from its checked options."""
    client: Any = maker_of(ref)(0)
    maker = ref.kind
    if ref.kind in CHECKPOINTS and client.version == UNKNOWN_VERSION:
        maker += f"://{content_of(ref.target)}"
    return {POLICY: maker, **told_apart(client.options)}


def _of_kind(ref: PolicyRef) -> dict[str, str]:
    named, typed = f"{ref.kind}:{content_of(ref.target)}", dict(ref.options)
    if not known_kinds().get(ref.kind):
        return {POLICY: named, **typed}
    kind = find_kind(ref.kind)
    maker = ref.kind if kind.target_may_move else named
    hands = _of_hands(typed.pop(HANDS, SCRIPTED))
    return {POLICY: maker, **dict(typed.items() - kind.defaults.items()), **hands}
