"""How many actions of a chunk a study executes: as many as the policy predicts."""

from __future__ import annotations

from roboirg.apps.real.control.robot import HORIZON
from roboirg.policies.by_name.policy_specs import SYSTEM
from roboirg.policies.by_name.systems import find_system
from roboirg.policies.contract.policy_urls import is_url, parse_query, split_url

_SCHEME, _OPTION = "mme-vla", "execute"


def at_horizon(spec: str) -> str:
    """Return a policy's spec with the study's horizon.

    Policies and systems behind ``mme-vla://`` execute fewer actions in simulation, as RoboMME's
    client does. What already names a number keeps it, as TTT-Expert's stride.
    """
    head, _, query = spec.partition("?")
    option = _OPTION
    url = spec
    if head.startswith(f"{SYSTEM}:"):
        url = find_system(head.partition(":")[2], parse_query(spec, query)).policy
        option = f"policy.{_OPTION}"
    if not is_url(url) or split_url(url).scheme != _SCHEME or _OPTION in split_url(url).options:
        return spec
    return f"{spec}{'&' if query else '?'}{option}={HORIZON}"
