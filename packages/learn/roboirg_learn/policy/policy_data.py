"""Recorded episodes, and episodes that are played, as numbers for the network.

A track is a thing that is followed from look to look, by its number. A decision is a look at which
the next waypoint, or subgoal, is chosen.
"""

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
from roboirg_learn.policy.sight import GHOST, LabeledLook, Sight, labeled_looks
from roboirg_learn.policy.subgoal_net import PlannedBatch
from roboirg_learn.policy.tracks import LookTokens, Tracks

COUNTED_LOOKS = 10
"""Looks without a decision at which a body learns how many stages are completed."""
NO_LABEL = -1
"""In the place of a move, thing or count that a network does not learn at a look."""
HEIGHT_SCALE = 5.0
FINGER_SCALE = 25.0
"""Per meter, so that these numbers of a tool are about as great as the others."""


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
        self._rows: list[dict[str, NDArray[Any]]] = []
        self._tools: list[NDArray[np.float32]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(
        self, look: LookTokens, tool: NDArray[np.floating[Any]], *, is_video: bool
    ) -> NDArray[np.int64]:
        """Add a look; returns the track of each of its things, -1 for one that is not tracked.

        Args:
            look: the n things that it shows.
            tool: (7,) x, y, z, m, roll, pitch, yaw, rad, and a finger's opening, m.
            is_video: whether it is one of the video.
        """
        tracks_of_look = self.tracks.update(look)
        self._rows.append(
            {
                "classes": self.tracks.classes.copy(),
                "places": self.tracks.places.copy(),
                "turns": self.tracks.turns.copy(),
                "seen": self.tracks.seen.copy(),
                "known": self.tracks.known,
            }
        )
        self._tools.append(_tool_numbers(tool, is_video=is_video))
        return tracks_of_look

    def numbers(self) -> LookNumbers:
        """Return all T looks so far as arrays (T, K, …), with K the number of tracked things.

        A thing that is out of sight has the place where it was last seen.
        """
        count = max(1, self.tracks.count)
        parts = {}
        for name in self._rows[0]:
            parts[name] = np.stack([row[name] for row in self._rows])[:, :count]
        return LookNumbers(**parts, tool=np.stack(self._tools))


def _tool_numbers(tool: NDArray[np.floating[Any]], *, is_video: bool) -> NDArray[np.float32]:
    """Return the tool's state as input of the network, (TOOL_NUMBERS,), scaled to similar sizes.

    Args:
        tool: (7,) x, y, z, m, roll, pitch, yaw, rad, and a finger's opening, m.
        is_video: whether the look is one of the video; 1 or 0 in the last number.
    """
    x, y, z, _, _, yaw, finger = tool
    height = z * HEIGHT_SCALE
    opening = finger * FINGER_SCALE
    # The gripper looks the same after half a turn.
    turn = math.cos(2 * yaw), math.sin(2 * yaw)
    return np.array([x, y, height, *turn, opening, is_video], np.float32)


class LookLabels:
    """What a network learns to say at some looks of an episode."""

    def __init__(self) -> None:
        self._looks: list[int] = []
        self._rows: list[tuple[int, int, int]] = []

    def add(self, look: int, done: int, move: int = NO_LABEL, thing: int = NO_LABEL) -> None:
        """Add the labels of a look.

        Args:
            look: its number.
            done: completed stages.
            move: number of the kind of waypoint, or of the form of subgoal; only at a decision.
            thing: track of the thing at whose place it is; only at a decision.
        """
        self._looks.append(look)
        self._rows.append((move, thing, done))

    def numbers(self, looks: LookNumbers, goal: NDArray[np.float32]) -> EpisodeNumbers:
        """Return an episode as network input with its labels; `goal` as in `EpisodeNumbers`."""
        moves, things, done = np.array(self._rows, np.int64).T
        return EpisodeNumbers(looks, goal, np.array(self._looks, np.int64), moves, things, done)


def to_numbers(
    recorded: ExpertRecording,
    decisions: Sequence[LookDecision],
    goal: NDArray[np.float32],
    sight: Sight,
    moves: Mapping[Any, int],
    rng: np.random.Generator,
) -> EpisodeNumbers:
    """Return a recorded episode as network input and labels, seen as by an imperfect detector.

    Args:
        recorded: the episode.
        decisions: of the episode; some looks between them are added, which have no move.
        goal: (size,) as `GoalLayout.numbers` returns it.
        sight: classes of things and their heights.
        moves: the number of each kind of waypoint, or of each form of subgoals.
        rng: draws the noise of the detector.
    """
    history = _LabeledHistory()
    labels = LookLabels()
    decision_at = {decision.look: decision for decision in decisions}
    skipped = _merged_looks(recorded) - decision_at.keys()
    counted = _counted_looks(recorded, rng)
    for look, labeled in enumerate(labeled_looks(recorded, sight, rng)):
        if look in skipped:
            continue
        is_video = bool(recorded.is_video[look])
        now = history.add(labeled, recorded.tool[look], is_video=is_video)
        done = int(recorded.done[look])
        if look in decision_at:
            decision = decision_at[look]
            move = moves.get(decision.move, NO_LABEL)
            labels.add(now, done, move, history.track(decision.thing))
        elif look in counted:
            labels.add(now, done)
    return labels.numbers(history.looks.numbers(), goal)


class _LabeledHistory:
    """The looks of a recorded episode so far, and the track of each object that was found.

    Attributes:
        looks: as a policy remembers them.
    """

    def __init__(self) -> None:
        self.looks = LookHistory()
        self._track_of: dict[int, int] = {}

    def add(self, labeled: LabeledLook, tool: NDArray[np.floating[Any]], *, is_video: bool) -> int:
        """Add a look; returns its number."""
        tracks = self.looks.add(labeled.tokens, tool, is_video=is_video)
        self._track_of.update(zip(labeled.objects.tolist(), tracks.tolist(), strict=True))
        return len(self.looks) - 1

    def track(self, number: int) -> int:
        """Return the track of an object by its number; `NO_LABEL` if it was never found."""
        if number == GHOST:
            return NO_LABEL
        return self._track_of.get(number, NO_LABEL)


def _merged_looks(recorded: ExpertRecording) -> set[int]:
    """Return the numbers of looks that are not at a multiple of `LOOK_EVERY` control steps.

    Between multiples only decisions are looked at. Where the expert decides to use the gripper
    after a move, a policy does not: it decides both at once, and so has no such look.
    """
    return {look for look in recorded.looks.tolist() if recorded.steps[look] % LOOK_EVERY}


def _counted_looks(recorded: ExpertRecording, rng: np.random.Generator) -> set[int]:
    """Draw up to `COUNTED_LOOKS` looks after the video, to learn completed stages at."""
    looks_after_video = np.flatnonzero(~recorded.is_video)
    count = min(COUNTED_LOOKS, len(looks_after_video))
    return set(rng.choice(looks_after_video, count, replace=False).tolist())


def to_batch(episodes: Sequence[EpisodeNumbers]) -> EpisodeBatch:
    """Return B episodes in one batch of tensors (B, …), padded to the longest.

    Padding is 0, and `NO_LABEL` in labels, so that it is not learned from.
    """
    looks = {}
    for name in LookNumbers._fields:
        looks[name] = _pad([getattr(episode.looks, name) for episode in episodes], 0)
    has_look = [np.ones(len(episode.looks.tool), bool) for episode in episodes]
    return EpisodeBatch(
        **looks,
        has_look=_pad(has_look, 0),
        goals=torch.from_numpy(np.stack([episode.goal for episode in episodes])),
        decisions=_pad([episode.decisions for episode in episodes], 0),
        moves=_pad([episode.moves for episode in episodes], NO_LABEL),
        things=_pad([episode.things for episode in episodes], NO_LABEL),
        done=_pad([episode.done for episode in episodes], NO_LABEL),
        planned=_pad_planned(
            [episode.planned for episode in episodes if episode.planned is not None]
        ),
    )


def _pad_planned(episodes: Sequence[PlannedNumbers]) -> PlannedBatch | None:
    """Return what hands or planners are given, padded; None for bodies without subgoals."""
    if not episodes:
        return None
    # 0 in padding is the first look; -1 everywhere would leave attention without any token.
    return PlannedBatch(
        context=_pad([episode.context for episode in episodes], 0),
        kept_looks=_pad([episode.kept_looks for episode in episodes], 0),
        to_keep=_pad([episode.to_keep for episode in episodes], NO_LABEL),
    )


def _pad(arrays: Sequence[NDArray[Any]], fill: int) -> torch.Tensor:
    """Return n arrays as one tensor (n, …), each filled up to the greatest size along each axis.

    Example: [1, 2] and [3] with fill 0 → [[1, 2], [3, 0]].
    """
    shape = np.max([array.shape for array in arrays], axis=0)
    padded = np.full((len(arrays), *shape), fill, arrays[0].dtype)
    for row, array in zip(padded, arrays, strict=True):
        filled_part = tuple(slice(size) for size in array.shape)
        row[filled_part] = array
    return torch.from_numpy(padded)
