"""Policies that are asked about several episodes at once.

Such a policy is made once per process. It has ``begin(instruction, demonstration) -> state``, one
object per episode, and ``act_batch(states, observations)``, which returns a chunk for each. If
``begin`` takes ``seed``, it gets the seed of the episode.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from roboirg.core.actions import Actions
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.plain_text import counted


def takes_batches(policy_class: object) -> bool:
    """Return whether a policy, or a class of policies, has ``begin`` and ``act_batch``."""
    return all(callable(getattr(policy_class, name, None)) for name in ("begin", "act_batch"))


class BatchedEpisode:
    """One episode of a policy that takes batches, in the form of a policy.

    Its other attributes are the policy's: ``cameras``, ``version``, ``metadata`` and so on.

    Args:
        policy: plays many episodes.
        seed: of the episode's random choices.
    """

    def __init__(self, policy: Any, seed: int) -> None:  # noqa: ANN401 - any class with two methods
        self._policy = policy
        self._seed = seed

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        if name in ("attach", "usage", "close", "follow") or name.startswith("_"):
            raise AttributeError(name)  # they would mean the policy, not the episode
        return getattr(self._policy, name)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Begin the episode."""
        begin = self._policy.begin
        if "seed" in parameters_of(begin):
            begin = functools.partial(begin, seed=self._seed)
        self._state = begin(instruction, demonstration)

    def act(self, observation: Observation) -> Actions:
        """Return the next actions."""
        return self.act_together([self], [observation])[0]

    def act_together(
        self, episodes: Sequence[BatchedEpisode], observations: Sequence[Observation]
    ) -> list[Actions]:
        """Return the next actions of several episodes of the same policy.

        Raises:
            ValueError: the policy did not return one chunk for each.
        """
        states = [episode._state for episode in episodes]  # noqa: SLF001 - of this class
        chunks = list(self._policy.act_batch(states, list(observations)))
        if len(chunks) != len(states):
            raise ValueError(
                f"act_batch() returned {counted(len(chunks), 'chunk')} for "
                f"{counted(len(states), 'episode')}"
            )
        return chunks

    def hear(self, text: str, step: int) -> None:
        """Pass an utterance on to ``hear(state, text, step)``, if the policy has it."""
        hear = getattr(self._policy, "hear", None)
        if callable(hear):
            hear(self._state, text, step)


_made: dict[tuple[str, object], Any] = {}
"""The policies of this process, by spec and class or object."""


def forget_batched(spec: str) -> None:
    """Forget the policies of a spec that this process has made, so that they are made anew."""
    for key in list(_made):
        made_spec, _ = key
        if made_spec == spec:
            del _made[key]


def make_batched(key: tuple[str, object], make: Callable[[], Any], seed: int) -> BatchedEpisode:
    """Return a new episode of a policy; the policy itself is made for the first one and then kept.

    Args:
        key: identifies the policy: its spec, and its class or object.
        make: makes it; called at most once for a key.
        seed: of the episode's random choices.
    """
    if key not in _made:
        _made[key] = make()
    return BatchedEpisode(_made[key], seed)


def parameters_of(function: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of a function or class, by name; none if it has no signature."""
    try:
        return inspect.signature(function).parameters
    except (TypeError, ValueError):  # written in C
        return {}
