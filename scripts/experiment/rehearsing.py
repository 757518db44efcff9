"""Skips the simulation of plays that repeat an earlier one.

Bodies of one training see with the same detector, and with the same goal they mostly do the same,
to the last bit. For the scene that is played, a tree keeps what was observed after which answers. A
policy that answers alike all the way gets the record of the earlier play.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import RoboIRGError
from roboirg.extension.policies import Demonstration, Observation
from roboirg.policies.contract.policy_calls import policy_subgoal
from roboirg.records.record import Job, Record
from roboirg_learn.policy.learned_policy import LearnedPolicy
from roboirg_learn.policy.object_detector import LabeledPicture, ObjectDetector
from roboirg_learn.policy.trained_body import Pictures, TrainedBody

SEEN = ("front_rgb", "joint_positions", "end_effector", "gripper")
"""What must be equal in two observations after the same answers."""


class Answer(NamedTuple):
    """What a policy answers to an observation: bytes of its actions, and the subgoal it names."""

    actions: bytes
    subgoal: str | None


BEGINNING = Answer(b"", None)
"""Stands before the first moment."""


@dataclass
class Moment:
    """A moment of a scene at which a policy was asked.

    Attributes:
        observation: that it was given.
        after: what followed each answer: the next moment, or at the end the record of the play.
    """

    observation: Observation
    after: dict[Answer, Moment | Record] = field(default_factory=dict)


class WatchedPolicy:
    """Wraps a policy and keeps its observations and answers; all words come before the first.

    Attributes:
        start: instruction and video, after `reset`.
        asked: observations with the answers to them.
    """

    start: tuple[str, Demonstration]

    def __init__(self, policy: LearnedPolicy) -> None:
        self._policy = policy
        self.asked: list[tuple[Observation, Answer]] = []

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the policy has
        return getattr(self._policy, name)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        self.start = instruction, demonstration
        self._policy.reset(instruction, demonstration)

    def act(self, observation: Observation) -> NDArray[Any]:
        actions = self._policy.act(observation)
        self.asked.append((observation, _answer(self._policy, actions)))
        return actions


class KnownScene:
    """The plays of one job, whatever its policy, as a tree of the answers that were given."""

    def __init__(self) -> None:
        self._start: tuple[str, Demonstration] | None = None
        self._plays: dict[Answer, Moment | Record] = {}
        self._found: dict[bytes, list[LabeledPicture]] = {}

    def rehearse(self, policy: LearnedPolicy) -> Record | None:
        """Return the record of an earlier play in which the same was done; None if there is none.

        Args:
            policy: a new one, which cannot play afterwards, as it has seen what it was asked about.
        """
        if self._start is None:
            return None
        policy.reset(*self._start)
        moment = self._plays.get(BEGINNING)
        while isinstance(moment, Moment):
            answer = _answer(policy, policy.act(moment.observation))
            moment = moment.after.get(answer)
        return moment

    def keep(self, policy: WatchedPolicy, record: Record) -> None:
        """Keep a play that was simulated, and its record, which must not be changed any more.

        Raises:
            RoboIRGError: what was observed is not what was observed after the same answers before.
        """
        self._start = policy.start
        after = self._plays
        answered = BEGINNING
        for observation, answer in policy.asked:
            moment = after.setdefault(answered, Moment(observation))
            if isinstance(moment, Record) or not _are_equal(moment.observation, observation):
                raise RoboIRGError(
                    f"{record.slug}: after the same actions the world is not the same as before, "
                    "so no play can stand for another one."
                )
            after = moment.after
            answered = answer
        after[answered] = record

    def with_eyes(self, body: TrainedBody, detector: str) -> TrainedBody:
        """Return a body that does not look twice at pictures of the scene.

        Args:
            body: the body.
            detector: hash of what it sees with.
        """
        eyes = _Eyes(body.detector, detector.encode(), self._found)
        return replace(body, detector=cast("ObjectDetector", eyes))


@functools.lru_cache(maxsize=1)
def known_scene(_job: Job) -> KnownScene:
    """Return what this process knows of a job, the key of the cache, whose plays come together.

    A play of 1,300 steps takes some 30 MB.
    """
    return KnownScene()


class _Eyes(NamedTuple):
    """A detector that keeps what it has found.

    Attributes:
        detector: the detector itself.
        name: its hash.
        found: by the hash of it and of the pictures that were given together.
    """

    detector: ObjectDetector
    name: bytes
    found: dict[bytes, list[LabeledPicture]]

    def find(self, pictures: Pictures) -> Sequence[LabeledPicture]:
        hashed = hashlib.sha256(self.name)
        for picture in pictures:
            hashed.update(picture.tobytes())
        key = hashed.digest()
        if key not in self.found:
            self.found[key] = self.detector.find(pictures)
        return self.found[key]


def _are_equal(first: Observation, second: Observation) -> bool:
    """Return whether two observations agree in what is `SEEN`."""
    seen: Any = first
    again: Any = second
    return all(np.array_equal(seen[name], again[name]) for name in SEEN)


def _answer(policy: LearnedPolicy, actions: NDArray[Any]) -> Answer:
    return Answer(actions.tobytes(), policy_subgoal(policy))
