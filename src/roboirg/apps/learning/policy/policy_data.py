"""Recorded episodes as numbers for the network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from roboirg.apps.learning.policy.body_net import TOOL_NUMBERS, EpisodeBatch
from roboirg.apps.learning.policy.moves import Decision, Move
from roboirg.apps.learning.policy.recording import RecordedEpisode
from roboirg.apps.learning.policy.sight import Sight, SightNoise, labeled_looks
from roboirg.apps.learning.policy.tracks import LookTokens, Tracks

MINUTE = 1200.0
"""Control steps."""


class EpisodeNumbers(NamedTuple):
    """One episode for the network; T looks, K tracks, D decisions; see `EpisodeBatch`."""

    classes: NDArray[np.int64]
    places: NDArray[np.float32]
    turns: NDArray[np.float32]
    seen: NDArray[np.bool_]
    known: NDArray[np.bool_]
    tool: NDArray[np.float32]
    goal: NDArray[np.float32]
    decisions: NDArray[np.int64]
    moves: NDArray[np.int64]
    things: NDArray[np.int64]


class LookHistory:
    """The looks of an episode so far, as rows that grow with the things that are seen."""

    def __init__(self) -> None:
        self._tracks = Tracks()
        self._rows: list[
            tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]
        ] = []
        self._tools: list[NDArray[np.float32]] = []

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def tracks(self) -> Tracks:
        return self._tracks

    def add(
        self, look: LookTokens, tool: NDArray[np.floating], *, is_video: bool, step: int
    ) -> NDArray[np.int64]:
        """Add a look; returns the track of each of its things."""
        mine = self._tracks.update(look)
        now = self._tracks
        self._rows.append(
            (now.classes.copy(), now.places.copy(), now.turns.copy(), now.seen.copy())
        )
        self._tools.append(tool_numbers(tool, is_video=is_video, step=step))
        return mine

    def numbers(
        self,
    ) -> tuple[
        NDArray[np.int64],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.bool_],
        NDArray[np.bool_],
        NDArray[np.float32],
    ]:
        """Return classes, places, turns, seen, known and tool of all looks."""
        length, count = len(self._rows), max(1, len(self._tracks.classes))
        classes = np.zeros((length, count), np.int64)
        places = np.zeros((length, count, 2), np.float32)
        turns = np.zeros((length, count, 2), np.float32)
        seen, known = np.zeros((length, count), bool), np.zeros((length, count), bool)
        for look, (kinds, spots, angles, shown) in enumerate(self._rows):
            own = len(kinds)
            classes[look, :own], places[look, :own], turns[look, :own] = kinds, spots, angles
            seen[look, :own], known[look, :own] = shown, True
        return classes, places, turns, seen, known, np.stack(self._tools)


def tool_numbers(tool: NDArray[np.floating], *, is_video: bool, step: int) -> NDArray[np.float32]:
    """Return what the network gets of the tool (7) and the time."""
    x, y, z, _, _, yaw, finger = tool
    time = step / MINUTE
    values = [
        x,
        y,
        z * 5.0,
        np.cos(2 * yaw),
        np.sin(2 * yaw),
        finger * 25.0,
        is_video,
        time,
        np.log1p(step) / 7.0,
    ]
    found = np.array(values, np.float32)
    if len(found) != TOOL_NUMBERS:
        raise RuntimeError("TOOL_NUMBERS disagrees with tool_numbers.")
    return found


def to_numbers(
    recorded: RecordedEpisode,
    decisions: Sequence[Decision],
    goal: NDArray[np.float32],
    sight: Sight,
    moves: Mapping[Move, int],
    noise: SightNoise,
    rng: np.random.Generator,
) -> EpisodeNumbers:
    """Return an episode as a detector with that noise would have seen it."""
    history = LookHistory()
    track_of: dict[int, int] = {}
    chosen: list[int] = []
    due = {one.look: one for one in decisions}
    # A look may belong to one decision only: opening and closing are part of the move before.
    for look, (tokens, objects) in enumerate(labeled_looks(recorded, sight, noise, rng)):
        mine = history.add(
            tokens,
            recorded.tool[look],
            is_video=bool(recorded.is_video[look]),
            step=int(recorded.steps[look]),
        )
        track_of.update(
            (int(thing), int(own)) for thing, own in zip(objects, mine, strict=True) if own >= 0
        )
        if look in due:
            chosen.append(track_of.get(due[look].thing, -1))
    own = [due[look] for look in sorted(due)]
    return EpisodeNumbers(
        *history.numbers(),
        goal,
        np.array([one.look for one in own], np.int64),
        np.array([moves.get(one.move, -1) for one in own], np.int64),
        np.array(chosen, np.int64),
    )


def to_batch(episodes: Sequence[EpisodeNumbers]) -> EpisodeBatch:
    """Return episodes padded to the longest."""
    return EpisodeBatch(
        *(_pad([getattr(one, name) for one in episodes], fill) for name, fill in _PADDED[:5]),
        _pad([one.tool for one in episodes], 0),
        _pad([np.ones(len(one.tool), bool) for one in episodes], fill=False),
        torch.from_numpy(np.stack([one.goal for one in episodes])),
        *(_pad([getattr(one, name) for one in episodes], fill) for name, fill in _PADDED[5:]),
    )


_PADDED: tuple[tuple[str, int], ...] = (
    ("classes", 0), ("places", 0), ("turns", 0), ("seen", 0), ("known", 0),
    ("decisions", 0), ("moves", -1), ("things", -1),
)  # fmt: skip


def _pad(arrays: Sequence[NDArray[np.generic]], fill: int) -> torch.Tensor:
    shape = tuple(max(own) for own in zip(*(one.shape for one in arrays), strict=True))
    padded = np.full((len(arrays), *shape), fill, arrays[0].dtype)
    for row, one in zip(padded, arrays, strict=True):
        row[tuple(slice(size) for size in one.shape)] = one
    return torch.from_numpy(padded)
