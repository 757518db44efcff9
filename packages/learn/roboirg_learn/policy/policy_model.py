"""A policy that has learned, made of a body and a reader, and an episode as it sees it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError, short_hash
from roboirg.extension.sight import LOOK_EVERY, points_of
from roboirg_learn.labeled_views import LATER_STEP
from roboirg_learn.listener.vocabulary import Vocabulary
from roboirg_learn.policy.body_net import BodyAnswer, BodyNet
from roboirg_learn.policy.memories import Carried
from roboirg_learn.policy.moves import waypoint
from roboirg_learn.policy.planner_history import PlannedNumbers
from roboirg_learn.policy.policy_data import NO_LABEL, EpisodeNumbers, LookHistory, to_batch
from roboirg_learn.policy.policy_files import PolicyFiles
from roboirg_learn.policy.tracks import LookTokens
from roboirg_learn.policy.trained_body import Pictures, TrainedBody, load_body
from roboirg_learn.policy.trained_reader import TrainedReader, load_reader

FIRST_LOOKS = (0, LATER_STEP // LOOK_EVERY)
"""Numbers of the looks at a video that the reader of words sees, two seconds apart."""
_BATCH = 32


class PolicyModel(NamedTuple):
    """A trained policy: a body, and a reader that names its goal."""

    body: TrainedBody
    reader: TrainedReader

    @property
    def version(self) -> str:
        """Fingerprint of both."""
        return short_hash(f"{self.body.version} {self.reader.version}")


def load_policy(files: PolicyFiles) -> PolicyModel:
    """Return a trained policy; nothing of its files is executed.

    Raises:
        InvalidValueError: a file is none of its kind, or they do not fit.
    """
    body = load_body(files.body)
    reader = load_reader(files.reader)
    words = reader.vocabulary.words
    fitting = Vocabulary(words, body.sight.classes, body.goals.tasks, body.goals.parts)
    if reader.vocabulary != fitting:
        raise InvalidValueError(
            f"The reader {str(files.reader)!r} does not fit the body {str(files.body)!r}, which "
            "knows other things or goals; train one for it with: roboirg learn reader "
            f"--body {files.body} --out FILE."
        )
    return PolicyModel(body, reader)


class NetworkChoice(NamedTuple):
    """What a network chooses.

    Attributes:
        kind: number of the kind of waypoint, or of the form of a subgoal.
        thing: track of the thing; None where there is none.
        to_keep: places among the recent looks of those to be kept.
    """

    kind: int
    thing: int | None
    to_keep: tuple[int, ...]


class _RememberedLooks(NamedTuple):
    """What a network knows of an episode's looks, given a goal."""

    goal: NDArray[np.float32]
    carried: Carried


class SeenEpisode:
    """One episode as a policy sees it.

    Args:
        model: the policy.

    Attributes:
        video_looks: number of looks at the video.
    """

    def __init__(self, model: PolicyModel) -> None:
        self._model = model
        self._history = LookHistory()
        self._first_looks: list[LookTokens] = []
        self._remembered: dict[BodyNet, _RememberedLooks] = {}
        self.video_looks = 0

    def look(
        self,
        pictures: Pictures,
        tools: Sequence[NDArray[np.floating[Any]]],
        *,
        is_video: bool,
    ) -> None:
        """Find the things of front pictures and remember them as looks.

        Args:
            pictures: uint8 (256, 256, 3) each, in the order of time.
            tools: (7,) at each picture, as `tool_of` returns it.
            is_video: whether they are of the video.
        """
        # Without a video the reader of words sees the first picture only.
        first_looks = FIRST_LOOKS if is_video else FIRST_LOOKS[:1]
        for start in range(0, len(pictures), _BATCH):
            part = slice(start, start + _BATCH)
            found = self._model.body.see(pictures[part])
            for tokens, tool in zip(found, tools[part], strict=True):
                if len(self._history) in first_looks:
                    self._first_looks.append(tokens)
                self._history.add(tokens, tool, is_video=is_video)
        if is_video:
            self.video_looks += len(pictures)

    def understand(self, text: str) -> NDArray[np.float32]:
        """Return the goal that an instruction means, as `GoalLayout.numbers` does."""
        return self._model.reader.understand(text, self._first_looks, self._model.body.goals)

    @property
    def looks(self) -> int:
        """Number of looks so far."""
        return len(self._history)

    @torch.no_grad()
    def choose(
        self, net: BodyNet, goal: NDArray[np.float32], planned: PlannedNumbers | None
    ) -> NetworkChoice:
        """Return what a network chooses after the last look.

        Args:
            net: a body, which chooses a kind of waypoint, or a planner, which chooses a subgoal.
            goal: as `understand` returns it.
            planned: for hands the subgoal, for a planner what it named and keeps; else None.
        """
        no_label = np.array([NO_LABEL])
        numbers = EpisodeNumbers(
            looks=self._history.numbers(),
            goal=goal,
            decisions=np.array([self.looks - 1]),
            moves=no_label,
            things=no_label,
            done=no_label,
            planned=planned,
        )
        answer: BodyAnswer = net(to_batch([numbers]), self._carried_for(net, goal))
        kind = int(answer.moves[0, 0].argmax())
        thing = int(answer.things[0, 0, kind].argmax())
        is_there = thing < self._history.tracks.count
        to_keep: tuple[int, ...] = ()
        if answer.keep_scores is not None:
            to_keep = tuple(np.flatnonzero(answer.keep_scores[0, 0].numpy() > 0))
        return NetworkChoice(kind, thing if is_there else None, to_keep)

    def _carried_for(self, net: BodyNet, goal: NDArray[np.float32]) -> Carried:
        """Return what a network remembers of the looks so far, which its next call goes on from.

        What is remembered depends on the goal, so with another goal (another utterance was heard)
        it begins anew.
        """
        remembered = self._remembered.get(net)
        if remembered is None or not np.array_equal(remembered.goal, goal):
            remembered = _RememberedLooks(goal, Carried())
            self._remembered[net] = remembered
        return remembered.carried

    def point(self, thing: int) -> NDArray[np.float64]:
        """Return where a thing, given by its track, was last seen: column and row, pixels, (2,)."""
        tracks = self._history.tracks
        height = self._model.body.sight.heights[tracks.classes[thing]]
        return points_of(np.append(tracks.places[thing].astype(np.float64), height))

    def decide(
        self,
        goal: NDArray[np.float32],
        tool: NDArray[np.floating[Any]],
        planned: PlannedNumbers | None = None,
    ) -> NDArray[np.float64]:
        """Return the next waypoint (7,), as `moves.waypoint` does, after the last look.

        Args:
            goal: as `understand` returns it.
            tool: (7,) pose and opening now.
            planned: the subgoal to follow, for hands.
        """
        body = self._model.body
        chosen = self.choose(body.net, goal, planned)
        move = body.moves[chosen.kind]
        if not move.at_thing or chosen.thing is None:
            here = np.asarray(tool[:2], np.float64)
            return waypoint(move, tool, here, np.array([1.0, 0.0]))
        tracks = self._history.tracks
        return waypoint(move, tool, tracks.places[chosen.thing], tracks.turns[chosen.thing])
