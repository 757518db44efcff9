"""Play episodes of a policy in turns, as they share a process in its host."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

from roboirg.apps.policy_check.policy_player import CALLS, Chunks
from roboirg.apps.policy_check.synthetic_episodes import SyntheticEpisode
from roboirg.core.actions import check_chunk
from roboirg.policies.by_name.loading import make_policy
from roboirg.policies.contract.base import close_policy
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.contract.random_state import RandomState


def play_in_turns(
    spec: str, seed: int, episodes: Sequence[SyntheticEpisode], *, together: bool = False
) -> list[Chunks]:
    """Return the actions of some calls in each episode, played in turns.

    Args:
        spec: of the policy.
        seed: of the policy.
        episodes: to play; every call shows the first observation.
        together: whether a policy that takes batches is asked about all of them at once.
    """
    randoms = [RandomState(seed) for _ in episodes]
    policies: list[Any] = []
    try:
        for episode, random in zip(episodes, randoms, strict=True):
            with random:
                policies.append(make_policy(spec, seed))
                given = copy.deepcopy(episode)
                policies[-1].reset(given.instruction, given.demonstration)
        space, found = PolicyNeeds.of(policies[0]).action_space, [Chunks() for _ in episodes]
        for _ in range(CALLS):
            moments = [copy.deepcopy(episode.first) for episode in episodes]
            if together:
                RandomState.set_aside()
                rows = policies[0].act_together(policies, moments)
            for number, (policy, random) in enumerate(zip(policies, randoms, strict=True)):
                with random:
                    chunk = rows[number] if together else policy.act(moments[number])
                found[number].append(check_chunk(chunk, space).copy())
        return found
    finally:
        for policy in policies:
            close_policy(policy)
