"""What is known of a scene: what was to be seen there after the actions that were played.

Bodies of one training see with the same detector, so that those with the same goal mostly do the
same, to the last bit. Then the world would answer the same, and need not be simulated.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, cast

from numpy.typing import NDArray

from roboirg.extension.policies import Demonstration, Observation
from roboirg.policies.contract.policy_calls import policy_subgoal
from roboirg.records.record import Job, Record
from roboirg_learn.policy.learned_policy import LearnedPolicy
from roboirg_learn.policy.object_detector import LabeledPicture, ObjectDetector
from roboirg_learn.policy.trained_body import Pictures, TrainedBody

SCENES = 2
"""Most scenes of which a worker keeps what is known."""


class Answer(NamedTuple):
    """What a policy answers to an observation: bytes of its actions, and the subgoal it names."""

    actions: bytes
    subgoal: str | None


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
    """A policy of which it is kept what it is given, and what it answers.

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
    """Plays of one scene with one verdict, as a tree of the answers that were given."""

    def __init__(self) -> None:
        self._start: tuple[str, Demonstration] | None = None
        self._first: Moment | None = None
        self._found: dict[bytes, list[LabeledPicture]] = {}

    def rehearse(self, policy: LearnedPolicy) -> Record | None:
        """Return the record of an earlier play in which the same was done; None if there is none.

        Args:
            policy: is asked about the observations of that play, and has to be made anew for more.
        """
        if self._start is None:
            return None
        policy.reset(*self._start)
        moment: Moment | Record | None = self._first
        while isinstance(moment, Moment):
            answer = _answer(policy, policy.act(moment.observation))
            moment = moment.after.get(answer)
        return moment

    def keep(self, policy: WatchedPolicy, record: Record) -> None:
        """Keep a play and its record, which must not be changed any more."""
        self._start = policy.start
        moment: Moment | None = self._first
        answered: Answer | None = None
        for observation, answer in policy.asked:
            if moment is None:
                self._first = moment = Moment(observation)
            elif answered is not None:
                after = moment.after.setdefault(answered, Moment(observation))
                moment = cast("Moment", after)
            answered = answer
        if moment is not None and answered is not None:
            moment.after[answered] = record

    def with_eyes(self, body: TrainedBody, detector: str) -> TrainedBody:
        """Return a body that does not look twice at pictures of the scene.

        Args:
            body: the body.
            detector: hash of what it sees with.
        """
        eyes = _Eyes(body.detector, detector.encode(), self._found)
        return replace(body, detector=cast("ObjectDetector", eyes))


@functools.lru_cache(maxsize=SCENES)
def known_scene(_job: Job) -> KnownScene:
    """Return what this process knows of the scene of a job."""
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


def _answer(policy: LearnedPolicy, actions: NDArray[Any]) -> Answer:
    return Answer(actions.tobytes(), policy_subgoal(policy))
