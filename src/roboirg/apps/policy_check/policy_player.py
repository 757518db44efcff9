"""Asks a policy in synthetic episodes, and keeps what several checks need to know about it."""

from __future__ import annotations

import copy
from functools import cached_property
from typing import NamedTuple

import numpy as np

from roboirg.apps.policy_check.check_result import ending_checks
from roboirg.apps.policy_check.expert_episode import ExpertEpisode, Rows
from roboirg.core.actions import ActionSpace
from roboirg.core.plain_text import counted
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.by_name.finding import make_policy
from roboirg.policies.contract.base import Policy, close_policy
from roboirg.policies.contract.policy_calls import check_rows
from roboirg.policies.contract.synthetic_episodes import SyntheticEpisode, SyntheticEpisodes

CALLS = 3
"""Calls of `act` in a synthetic episode."""
VIDEO_STEPS = 40
Chunks = list[Rows]
FIRST = "Put the red cube on the target."
SECOND = "Press the second button from the left."


class SyntheticRollout(NamedTuple):
    """The policy's actions in a synthetic episode.

    Attributes:
        chunks: (n, size) each.
        dtype: of the last answer.
    """

    chunks: Chunks
    dtype: str


class PolicyPlayer:
    """Makes a policy and asks it; episodes depend on the seed alone.

    Checks run in a fixed order and leave here what later ones need.

    Args:
        source: a spec, or an object, which is reset wherever a spec would give a fresh object.
        seed: of the policy and of the synthetic episodes.

    Attributes:
        needs: of the policy; its defaults until `check_requirements` sets it.
        repeatable: whether two equal episodes had equal actions; False until `check_determinism`
            sets it.
    """

    def __init__(self, source: str | Policy, seed: int) -> None:
        """Note the policy; it is made when it is first needed."""
        self.source = source
        self.seed = seed
        self.needs = PolicyNeeds()
        self.repeatable = False
        self._policy: Policy | None = None

    @property
    def policy(self) -> Policy:
        """The policy that was made or asked last."""
        return self._policy if self._policy is not None else self.make_fresh()

    @property
    def space(self) -> ActionSpace:
        """The policy's action space."""
        return self.needs.action_space

    @cached_property
    def without_video(self) -> SyntheticEpisode:
        """The inputs of an episode without a video; `play` copies them."""
        return SyntheticEpisodes(self.needs, self.seed).episode(FIRST, 0)

    @cached_property
    def with_video(self) -> SyntheticEpisode:
        """The inputs of an episode with a video; `play` copies them."""
        return SyntheticEpisodes(self.needs, self.seed).episode(SECOND, VIDEO_STEPS)

    @cached_property
    def first_rollout(self) -> SyntheticRollout:
        """The rollout of the episode without a video."""
        return self.play("acts without a video", self.without_video)

    @cached_property
    def expected(self) -> SyntheticRollout:
        """The rollout of the episode with a video, played first by a fresh policy."""
        return self.play("acts with a video", self.with_video)

    def play(
        self,
        check: str,
        episode: SyntheticEpisode,
        *,
        fresh: bool = True,
        calls: int = CALLS,
    ) -> SyntheticRollout:
        """Reset the policy and ask it a few times; return its answers.

        It gets a copy of the episode, as it may change what it is given. Each observation after the
        first is as many steps later as the last answer had actions.

        Args:
            check: that is under way.
            episode: its inputs.
            fresh: whether to make the policy anew, if it is a spec.
            calls: of `act`.

        Raises:
            CheckAbortedError: the policy raised, or gave no actions.
        """
        episode = copy.deepcopy(episode)
        with ending_checks(check, "reset(): "):
            policy = self.make_fresh() if fresh else self.policy
            policy.reset(episode.instruction, episode.demonstration)
        episodes = SyntheticEpisodes(self.needs, self.seed)
        observation = episode.first
        chunks: Chunks = []
        dtype = ""
        for _ in range(calls):
            with ending_checks(check, "act(): "):
                actions = policy.act(observation)
                chunk = check_rows(actions, self.space)
            chunks.append(chunk.copy())  # a policy may reuse its array
            dtype = str(np.asarray(actions).dtype)
            observation = episodes.after(episode, len(chunk))
        return SyntheticRollout(chunks, dtype)

    def ask(self, episode: ExpertEpisode) -> Chunks:
        """Return a fresh policy's answers, (n, size) each, at the moments of the expert's episode.

        Its errors are not caught. The observations follow the expert, whatever the policy answers.
        """
        policy = self.make_fresh()
        policy.reset(episode.instruction, episode.demonstration)
        answers: Chunks = []
        for moment in episode.moments:
            actions = policy.act(copy.deepcopy(moment.observation))
            answers.append(check_rows(actions, self.space).copy())
        return answers

    def make_fresh(self) -> Policy:
        """Return a fresh policy, or the object; the one before is closed."""
        self.close()
        source = self.source
        self._policy = make_policy(source, self.seed) if isinstance(source, str) else source
        return self._policy

    def close(self) -> None:
        """Close the policy that was made last."""
        policy = self._policy
        self._policy = None
        close_policy(policy)


def are_equal(one: SyntheticRollout, other: SyntheticRollout) -> bool:
    """Return whether two rollouts have the same actions, bit for bit.

    Both must have as many chunks, as `PolicyPlayer.play` gives with equal `calls`.
    """
    return all(map(np.array_equal, one.chunks, other.chunks))


def describe_difference(expected: SyntheticRollout, other: SyntheticRollout) -> str:
    """Return where two rollouts first differ, with the numbers of both.

    An example is ``value 3 of row 0 in answer 2: expected 0.1, got 0.112``, or where an answer has
    another number of actions, ``answer 1: expected 5 actions, got 4``. Answers are counted from 1,
    rows and values from 0. It is empty if they are equal.
    """
    for answer, (chunk, got) in enumerate(zip(expected.chunks, other.chunks, strict=True), 1):
        if len(chunk) != len(got):
            return f"answer {answer}: expected {counted(len(chunk), 'action')}, got {len(got)}"
        for row, column in np.argwhere(chunk != got):
            return (
                f"value {column} of row {row} in answer {answer}: expected "
                f"{chunk[row, column]:.6g}, got {got[row, column]:.6g}"
            )
    return ""
