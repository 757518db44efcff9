"""A policy that has learned, made of a body and a reader, and an episode as it sees it.

A look is a moment at which the front picture is looked at; a track is an object that is followed
from look to look, known by its number.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError, short_hash
from roboirg.extension.sight import LOOK_EVERY, points_of
from roboirg_learn.labeled_views import LATER_STEP
from roboirg_learn.policy.body_net import BodyAnswer, BodyNet
from roboirg_learn.policy.memories import MemoryCache
from roboirg_learn.policy.moves import NO_LABEL, STAY, waypoint
from roboirg_learn.policy.planner_history import SubgoalInputs
from roboirg_learn.policy.policy_data import LABELS, EpisodeArrays, LookHistory, to_batch
from roboirg_learn.policy.policy_files import PolicyFiles
from roboirg_learn.policy.timing import timed_move
from roboirg_learn.policy.tracks import Detections
from roboirg_learn.policy.trained_body import Pictures, TrainedBody, load_body
from roboirg_learn.policy.trained_reader import TrainedReader, load_reader

FIRST_LOOKS = (0, LATER_STEP // LOOK_EVERY)
"""Numbers of the looks at a video that the reader of words sees, two seconds apart."""
SEEN_TOGETHER = 32
"""Pictures that go through the detector together."""


class PolicyModel(NamedTuple):
    """A trained policy: a body, which sees and acts, and a reader, which names its goal."""

    body: TrainedBody
    reader: TrainedReader

    @property
    def version(self) -> str:
        """Fingerprint of both."""
        return short_hash(f"{self.body.version} {self.reader.version}")


def load_policy(files: PolicyFiles) -> PolicyModel:
    """Return a trained policy; nothing of its files is executed.

    Body and reader fit if they number the same classes, tasks and parts of goals in the same order.

    Raises:
        InvalidValueError: a file is none of its kind, or they do not fit.
    """
    body = load_body(files.body)
    reader = load_reader(files.reader)
    known = body.object_classes.names, body.goals.tasks, body.goals.parts
    if reader.vocabulary[1:] != known:
        raise InvalidValueError(
            f"The reader {str(files.reader)!r} does not fit the body {str(files.body)!r}, which "
            "knows other things or goals; train one for it with: roboirg learn reader "
            f"--body {files.body} --out FILE."
        )
    return PolicyModel(body, reader)


class NetworkChoice(NamedTuple):
    """What a network chooses.

    Attributes:
        number: of the move, or of the subgoal template.
        track: of the object that it is at; None if nothing has been seen yet.
        to_keep: indices, among the `RECENT` latest looks, of those that a planner is to keep.
    """

    number: int
    track: int | None
    to_keep: tuple[int, ...]


class SeenEpisode:
    """One episode as a policy sees it: `look` adds looks, the other methods use those so far.

    Args:
        model: the policy.

    Attributes:
        video_looks: number of looks at the video.
    """

    def __init__(self, model: PolicyModel) -> None:
        self._model = model
        self._history = LookHistory()
        self._first_looks: list[Detections] = []
        self._caches: dict[tuple[BodyNet, bytes], MemoryCache] = {}
        self._is_waiting = False
        self.video_looks = 0

    def look(
        self,
        pictures: Pictures,
        tools: Sequence[NDArray[np.floating[Any]]],
        *,
        is_video: bool,
    ) -> None:
        """Find the objects of front pictures and add them as looks.

        Args:
            pictures: uint8 (256, 256, 3) each, in the order of time.
            tools: (7,) at each picture, as `tool_of` returns it.
            is_video: whether they are of the video.
        """
        # Without a video the reader of words sees the first picture only.
        first_looks = FIRST_LOOKS if is_video else FIRST_LOOKS[:1]
        for start in range(0, len(pictures), SEEN_TOGETHER):
            part = slice(start, start + SEEN_TOGETHER)
            found = self._model.body.see(pictures[part])
            for detections, tool in zip(found, tools[part], strict=True):
                if len(self._history) in first_looks:
                    self._first_looks.append(detections)
                self._history.add(detections, tool, is_video=is_video)
        if is_video:
            self.video_looks += len(pictures)

    def understand(self, text: str) -> NDArray[np.float32]:
        """Return the goal that an instruction means, as `GoalLayout.encode` does: (size,)."""
        heard = self._model.reader.hear(text, self._first_looks)
        return self._model.body.goals.encode(heard.task, heard.answer)

    @property
    def looks(self) -> int:
        """Number of looks so far."""
        return len(self._history)

    @torch.no_grad()
    def choose(
        self,
        net: BodyNet,
        goal: NDArray[np.float32],
        subgoal_inputs: SubgoalInputs | None,
        is_wait: NDArray[np.bool_] | None = None,
    ) -> NetworkChoice:
        """Return what a network chooses after the last look.

        Args:
            net: a body's, which chooses a move, or a planner, which chooses a subgoal template.
            goal: as `understand` returns it.
            subgoal_inputs: for hands the subgoal, for a planner what it named and keeps; else None.
            is_wait: (M,) which moves are waits, to be ended in time; None for a planner.
        """
        unlabeled = EpisodeArrays(
            looks=self._history.to_arrays(),
            goal=goal,
            decisions=np.array([self.looks - 1]),
            **dict.fromkeys(LABELS, np.array([NO_LABEL])),
            subgoal_inputs=subgoal_inputs,
        )
        # A batch of one episode with one decision.
        answer: BodyAnswer = net(to_batch([unlabeled]), self._cache_for(net, goal))
        scores = answer.moves[0].numpy()
        number = int(scores.argmax())
        if is_wait is not None:
            time_left = float(answer.time_left)
            number = timed_move(scores, is_wait, time_left, was_waiting=self._is_waiting)
            self._is_waiting = bool(is_wait[number])
        track = int(answer.tracks[0, number].argmax())
        is_there = track < self._history.tracks.count
        to_keep: tuple[int, ...] = ()
        if answer.keep_scores is not None:
            to_keep = tuple(np.flatnonzero(answer.keep_scores[0].numpy() > 0))
        return NetworkChoice(number, track if is_there else None, to_keep)

    def _cache_for(self, net: BodyNet, goal: NDArray[np.float32]) -> MemoryCache:
        """Return the cache of a network's memory, which its next call goes on from and updates.

        What is remembered depends on the goal, so each goal that was heard has its own.
        """
        return self._caches.setdefault((net, goal.tobytes()), MemoryCache())

    def point(self, track: int) -> NDArray[np.float64]:
        """Return the pixel, column and row (2,), where the object of a track was last seen."""
        tracks = self._history.tracks
        height = self._model.body.object_classes.heights[tracks.classes[track]]
        return points_of(np.append(tracks.positions[track].astype(np.float64), height))

    def decide(
        self,
        goal: NDArray[np.float32],
        tool: NDArray[np.floating[Any]],
        subgoal_inputs: SubgoalInputs | None = None,
    ) -> NDArray[np.float64]:
        """Return the next waypoint (7,), as `moves.waypoint` does, after the last look.

        Args:
            goal: as `understand` returns it.
            tool: (7,) pose and opening now.
            subgoal_inputs: the subgoal to follow, for hands.
        """
        body = self._model.body
        is_wait = np.array([move.turn == STAY for move in body.moves])
        chosen = self.choose(body.net, goal, subgoal_inputs, is_wait)
        move = body.moves[chosen.number]
        if not move.at_object or chosen.track is None:
            here = np.asarray(tool[:2], np.float64)
            unturned = np.array([1.0, 0.0])  # yaw code of the angle 0
            return waypoint(move, tool, here, unturned)
        tracks = self._history.tracks
        return waypoint(move, tool, tracks.positions[chosen.track], tracks.yaw_codes[chosen.track])
