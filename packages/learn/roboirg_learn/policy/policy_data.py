"""Recorded episodes, and episodes that are played, as numbers for the network."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from roboirg.extension.sight import LOOK_EVERY, ExpertRecording
from roboirg_learn.policy.body_net import EpisodeBatch
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.planner_history import PlannedNumbers
from roboirg_learn.policy.sight import GHOST, Sight, labeled_looks
from roboirg_learn.policy.subgoal_net import PlannedBatch
from roboirg_learn.policy.tracks import LookTokens, Tracks

COUNTED_LOOKS = 10
"""Looks of an episode, besides those of decisions, at which a body learns what is completed."""


class LookNumbers(NamedTuple):
    """The looks of an episode; T looks, K things; fields as in `EpisodeBatch`, without B."""

    classes: NDArray[np.int64]
    places: NDArray[np.float32]
    turns: NDArray[np.float32]
    seen: NDArray[np.bool_]
    known: NDArray[np.bool_]
    tool: NDArray[np.float32]


class EpisodeNumbers(NamedTuple):
    """An episode for the network; D decisions; fields as in `EpisodeBatch`, without B."""

    looks: LookNumbers
    goal: NDArray[np.float32]
    decisions: NDArray[np.int64]
    moves: NDArray[np.int64]
    things: NDArray[np.int64]
    done: NDArray[np.int64]
    planned: PlannedNumbers | None = None


class LookHistory:
    """The looks of an episode so far.

    Attributes:
        tracks: the things that were seen.
    """

    def __init__(self) -> None:
        self.tracks = Tracks()
        self._rows: list[tuple[NDArray[Any], ...]] = []
        self._tools: list[NDArray[np.float32]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(
        self, look: LookTokens, tool: NDArray[np.floating[Any]], *, is_video: bool
    ) -> NDArray[np.int64]:
        """Add a look; returns the track of each of its things.

        Args:
            look: the things.
            tool: (7,) pose and opening; see `ExpertRecording`.
            is_video: whether it is one of the video.
        """
        mine = self.tracks.update(look)
        now = self.tracks
        self._rows.append(
            (now.classes.copy(), now.places.copy(), now.turns.copy(), now.seen.copy(), now.known)
        )
        self._tools.append(_tool_numbers(tool, is_video=is_video))
        return mine

    def numbers(self) -> LookNumbers:
        """Return all looks; a thing has the place where it was last seen."""
        count = max(1, self.tracks.count)
        parts = [np.stack(part)[:, :count] for part in zip(*self._rows, strict=True)]
        return LookNumbers._make([*parts, np.stack(self._tools)])


def _tool_numbers(tool: NDArray[np.floating[Any]], *, is_video: bool) -> NDArray[np.float32]:
    x, y, z, _, _, yaw, finger = tool
    turn = math.cos(2 * yaw), math.sin(2 * yaw)
    return np.array([x, y, z * 5.0, *turn, finger * 25.0, is_video], np.float32)


def to_numbers(
    recorded: ExpertRecording,
    decisions: Sequence[LookDecision],
    goal: NDArray[np.float32],
    sight: Sight,
    moves: Mapping[Any, int],
    rng: np.random.Generator,
) -> EpisodeNumbers:
    """Return a recorded episode as a detector would have seen it.

    Args:
        recorded: the episode.
        decisions: of the episode; some looks between them are added, which have no move.
        goal: (parts,) 1 for each part of its goal.
        sight: of the camera.
        moves: the number of each kind of waypoint, or of each form of subgoals.
        rng: draws the noise of the detector.
    """
    history = LookHistory()
    track_of: dict[int, int] = {}
    times: list[int] = []
    asked: list[tuple[int, int, int]] = []
    due = {one.look: one for one in decisions}
    merged = set(recorded.looks.tolist()) - due.keys()
    acting = np.flatnonzero(~recorded.is_video)
    counted = set(rng.choice(acting, min(COUNTED_LOOKS, len(acting)), replace=False).tolist())
    for look, (tokens, objects) in enumerate(labeled_looks(recorded, sight, rng)):
        if look in merged and recorded.steps[look] % LOOK_EVERY:
            continue  # who opens or closes the gripper with the move before does not look here
        mine = history.add(tokens, recorded.tool[look], is_video=bool(recorded.is_video[look]))
        track_of.update(zip(objects.tolist(), mine.tolist(), strict=True))
        track_of[GHOST] = -1
        done = int(recorded.done[look])
        if look in due:
            one = due[look]
            asked.append((moves.get(one.move, -1), track_of.get(one.thing, -1), done))
        elif look in counted:
            asked.append((-1, -1, done))
        else:
            continue
        times.append(len(history) - 1)
    numbers = np.array(asked, np.int64)
    return EpisodeNumbers(history.numbers(), goal, np.array(times, np.int64), *numbers.T)


def to_batch(episodes: Sequence[EpisodeNumbers]) -> EpisodeBatch:
    """Return episodes padded to the longest."""
    looks, goals, decisions, moves, things, done, planned = zip(*episodes, strict=True)
    of_looks = {
        name: _pad([getattr(own, name) for own in looks], 0) for name in LookNumbers._fields
    }
    there = [np.ones(len(own.tool), bool) for own in looks]
    return EpisodeBatch(
        **of_looks,
        there=_pad(there, 0),
        goals=torch.from_numpy(np.stack(goals)),
        decisions=_pad(decisions, 0),
        moves=_pad(moves, -1),
        things=_pad(things, -1),
        done=_pad(done, -1),
        planned=_planned([own for own in planned if own is not None]),
    )


def _planned(episodes: Sequence[PlannedNumbers]) -> PlannedBatch | None:
    if not episodes:
        return None
    context, kept, keys = zip(*episodes, strict=True)
    # A decision that is there for padding sees the first look.
    return PlannedBatch(_pad(context, 0), _pad(kept, 0), _pad(keys, -1))


def _pad(arrays: Sequence[NDArray[Any]], fill: int) -> torch.Tensor:
    shape = tuple(max(own) for own in zip(*(one.shape for one in arrays), strict=True))
    padded = np.full((len(arrays), *shape), fill, arrays[0].dtype)
    for row, one in zip(padded, arrays, strict=True):
        row[tuple(slice(size) for size in one.shape)] = one
    return torch.from_numpy(padded)
