"""What a policy has learned, in one file of plain tensors, and an episode that it plays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from roboirg.apps.learning.policy.body_net import BodyNet
from roboirg.apps.learning.policy.moves import Move, waypoint
from roboirg.apps.learning.policy.policy_data import EpisodeNumbers, LookHistory, to_batch
from roboirg.apps.learning.policy.sight import Sight
from roboirg.apps.learning.policy.thing_detector import ThingDetector
from roboirg.apps.learning.policy.tracks import LookTokens

HOME = np.array([np.pi, 0.0, 0.0])


class PolicyModel(NamedTuple):
    """A trained policy.

    Attributes:
        sight: classes of things and their heights.
        detector: finds them.
        moves: kinds of waypoints.
        body: chooses.
        parts: of goals.
        about: how it was trained.
        version: a fingerprint.
    """

    sight: Sight
    detector: ThingDetector
    moves: tuple[Move, ...]
    body: BodyNet
    parts: tuple[str, ...]
    about: dict[str, Any]
    version: str


class PlayedEpisode:
    """One episode as the policy sees it."""

    def __init__(self, model: PolicyModel, goal: NDArray[np.float32]) -> None:
        self._model, self._goal = model, goal
        self._history = LookHistory()

    def look(
        self,
        pictures: Sequence[NDArray[np.uint8]],
        tools: Sequence[NDArray[np.floating[Any]]],
        steps: Sequence[int],
        *,
        is_video: bool,
    ) -> None:
        """See pictures."""
        for start in range(0, len(pictures), 32):
            part = slice(start, start + 32)
            for found, tool, step in zip(
                self._model.detector.find(pictures[part]), tools[part], steps[part], strict=True
            ):
                places = self._model.sight.places(found.classes, found.points)
                self._history.add(
                    LookTokens(found.classes, places, found.turns),
                    tool,
                    is_video=is_video,
                    step=step,
                )

    @torch.no_grad()
    def decide(self, tool: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """Return the next waypoint (7), after the last look."""
        numbers = EpisodeNumbers(
            *self._history.numbers(),
            self._goal,
            np.array([len(self._history) - 1]),
            np.array([-1]),
            np.array([-1]),
        )
        kinds, things = self._model.body(to_batch([numbers]))
        kind = int(kinds[0, 0].argmax())
        thing = int(things[0, 0, kind].argmax())
        move = self._model.moves[kind]
        tracks = self._history.tracks
        nothing = np.zeros(2)
        place, turn = (
            (tracks.places[thing], tracks.turns[thing])
            if move.at_thing and tracks.count
            else (nothing, nothing)
        )
        return waypoint(move, tool[:6], place, turn, HOME)
