"""What a policy is besides its version, wherever it is; nothing of others is imported for it.

An address and a path may change, and so may options that are `NOT_COMPARED`. All else makes another
policy. Of a kind in a package of others, everything that is typed does.
"""

from __future__ import annotations

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
from roboirg.policies.by_name.policy_classes import CHECKPOINTS, url_classes
from roboirg.policies.by_name.policy_kinds import (
    LISTENER,
    PLANNER,
    find_kind,
    known_kinds,
    listener_options,
    split_spec,
    system_of,
)
from roboirg.policies.contract.option_checking import content_of, told_apart
from roboirg.policies.contract.policy_urls import is_url, read_options
from roboirg.policies.planners import planner_options
from roboirg.policies.planners.systems import System


def makeup_of(ref: PolicyRef) -> Makeup:
    """Return what a policy is; raises like `roboirg.policies.by_name.finding.read_policy`."""
    system = system_of(ref.kind, ref.target, dict(ref.options))
    if system is not None and system.planner is None:
        return makeup_of(split_spec(ref.name, system.policy))
    if system is not None:
        found = _of_planner(system)
    elif ref.kind in (BUILT_IN, CLASS):
        found = {POLICY: ref.target}
    elif ref.kind == LISTENER:
        found = {POLICY: LISTENER, **told_apart(listener_options(ref.target, dict(ref.options)))}
    else:
        found = _of_url(ref) if is_url(ref.body) else _of_kind(ref)
    maker = found.pop(POLICY)
    if ref.is_declared:
        maker = PRIVILEGED + maker
    return ((POLICY, maker), *sorted(found.items()))


def _of_planner(system: System) -> dict[str, str]:
    options = dict(system.planner or {})
    kind = str(options.pop("kind", ""))
    found = {POLICY: f"{PLANNER}:{kind}"}
    if ":" not in kind:  # else it is the user's own, which has no options
        found |= told_apart(planner_options(kind, options, system.name))
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


def _of_url(ref: PolicyRef) -> dict[str, str]:
    options = read_options(ref, url_classes()[ref.kind].options_type)
    maker = ref.kind
    if ref.kind in CHECKPOINTS and options.version == UNKNOWN_VERSION:
        maker += f"://{content_of(ref.target)}"
    return {POLICY: maker, **told_apart(options)}


def _of_kind(ref: PolicyRef) -> dict[str, str]:
    named, typed = f"{ref.kind}:{content_of(ref.target)}", dict(ref.options)
    if not known_kinds().get(ref.kind):
        return {POLICY: named, **typed}
    kind = find_kind(ref.kind)
    maker = ref.kind if kind.target_may_move else named
    hands = _of_hands(typed.pop(HANDS, SCRIPTED))
    return {POLICY: maker, **dict(typed.items() - kind.defaults.items()), **hands}
