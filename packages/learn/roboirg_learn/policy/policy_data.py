"""Recorded episodes, and episodes that are played, as arrays for the network.

A look is a moment at which the front picture is looked at; a track is an object that is followed
from look to look, known by its number. A decision is a look at which the next waypoint, or subgoal,
is chosen. Looks of an episode are numbered from 0 in the order in which they are added.
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
from roboirg_learn.policy.memories import Decisions
from roboirg_learn.policy.moves import NO_LABEL, LookDecision
from roboirg_learn.policy.planner_history import SubgoalInputs
from roboirg_learn.policy.sight import (
    FALSE_POSITIVE,
    ObjectClasses,
    labeled_looks,
)
from roboirg_learn.policy.subgoal_net import SubgoalInputBatch
from roboirg_learn.policy.timing import passes_so_far, steps_to_act
from roboirg_learn.policy.tracks import Detections, Tracker

TRACKED = ("classes", "positions", "yaw_codes", "visible", "confirmed")
"""Fields of `LookArrays` that a `Tracker` has."""
LABELS = ("moves", "tracks", "stages_done", "passes", "steps_left")
"""Fields of `EpisodeArrays` and `EpisodeBatch` that a network learns from, and does not read."""
COUNTED_LOOKS = 10
"""Looks without a decision at which a body learns to count, and how long it is to wait."""
HEIGHT_SCALE = 5.0
FINGER_SCALE = 25.0
"""Per meter, so that these numbers of a tool are about as great as the others."""


class LookArrays(NamedTuple):
    """The looks of an episode; T looks, K tracks; fields as in `EpisodeBatch`, without B."""

    classes: NDArray[np.int64]
    positions: NDArray[np.float32]
    yaw_codes: NDArray[np.float32]
    visible: NDArray[np.bool_]
    confirmed: NDArray[np.bool_]
    tool: NDArray[np.float32]


class EpisodeArrays(NamedTuple):
    """An episode as input of the network, with labels (D,) of its D decisions.

    `decisions` are the numbers of their looks; other fields are as in `EpisodeBatch`, without B.
    `to_batch` makes one of several episodes.
    """

    looks: LookArrays
    goal: NDArray[np.float32]
    decisions: NDArray[np.int64]
    moves: NDArray[np.int64]
    tracks: NDArray[np.int64]
    stages_done: NDArray[np.int64]
    passes: NDArray[np.int64]
    steps_left: NDArray[np.int64]
    subgoal_inputs: SubgoalInputs | None = None


class LookHistory:
    """The looks of an episode so far, and how its objects were tracked.

    Attributes:
        tracks: the objects that were seen, as after the last look.
    """

    def __init__(self) -> None:
        self.tracks = Tracker()
        self._rows: list[dict[str, NDArray[Any]]] = []
        self._tools: list[NDArray[np.float32]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def add(
        self, look: Detections, tool: NDArray[np.floating[Any]], *, is_video: bool
    ) -> NDArray[np.int64]:
        """Add a look; return the track of each of its detections (n,), `NO_TRACK` for none.

        Args:
            look: the n objects found.
            tool: (7,) x, y, z, m, roll, pitch, yaw, rad, and a finger's opening, m.
            is_video: whether it is one of the video.
        """
        tracks_of_look = self.tracks.update(look)
        # Copies, because the tracker changes its arrays in place.
        self._rows.append({name: getattr(self.tracks, name).copy() for name in TRACKED})
        self._tools.append(_tool_numbers(tool, is_video=is_video))
        return tracks_of_look

    def to_arrays(self) -> LookArrays:
        """Return all T looks so far as arrays (T, K, …), with K the number of tracks, at least 1.

        An object that is out of sight has the position where it was last seen.
        """
        count = max(1, self.tracks.count)
        parts = {}
        for name in TRACKED:
            parts[name] = np.stack([row[name] for row in self._rows])[:, :count]
        return LookArrays(**parts, tool=np.stack(self._tools))


def _tool_numbers(tool: NDArray[np.floating[Any]], *, is_video: bool) -> NDArray[np.float32]:
    """Return the tool's state as input of the network, scaled to similar sizes: (TOOL_NUMBERS,).

    They are x, y, height, cosine and sine of twice the yaw, the opening, and 1 for a video.

    Args:
        tool: (7,) x, y, z, m, roll, pitch, yaw, rad, and a finger's opening, m.
        is_video: whether the look is one of the video.
    """
    x, y, z, _, _, yaw, finger = tool
    height = z * HEIGHT_SCALE
    opening = finger * FINGER_SCALE
    # The gripper looks the same after half a turn.
    yaw_code = math.cos(2 * yaw), math.sin(2 * yaw)
    return np.array([x, y, height, *yaw_code, opening, is_video], np.float32)


class LookLabels(NamedTuple):
    """What a network learns at one look; each field is one of D numbers in `EpisodeArrays`.

    Names and meanings of the fields are those of `EpisodeArrays`, `NO_LABEL` where there is nothing
    to learn. In an episode of three looks with decisions at the first and the last, the field
    `decisions` is 0 in the first labels and 2 in the second.
    """

    decisions: int
    moves: int
    tracks: int
    stages_done: int
    passes: int
    steps_left: int


def to_arrays(
    recorded: ExpertRecording,
    decisions: Sequence[LookDecision],
    goal: NDArray[np.float32],
    object_classes: ObjectClasses,
    moves: Mapping[Any, int],
    rng: np.random.Generator,
) -> EpisodeArrays:
    """Return a recorded episode as network input and labels, seen as by an imperfect detector.

    Looks that a policy would not have are left out, and the others numbered anew: if the recording
    has looks 0 to 3 and look 2 is left out, look 3 becomes 2.

    Args:
        recorded: the episode.
        decisions: of the episode; at some looks between them only counts and waits are labeled.
        goal: (size,) as `GoalLayout.encode` returns it.
        object_classes: classes of objects and their heights.
        moves: the number of each move, or of each subgoal template; one that is missing gets
            `NO_LABEL`.
        rng: draws the counted looks, then the noise of the detector; in this order, so that a seed
            always gives the same episode.
    """
    skipped = _skipped_looks(recorded, decisions)
    learned = {decision.look: decision for decision in decisions}
    for look in _counted_looks(recorded, rng):
        learned.setdefault(
            look, LookDecision(look, None, FALSE_POSITIVE)
        )  # neither move nor object
    passes = passes_so_far(recorded)
    steps_left = steps_to_act(recorded)

    history = LookHistory()
    last_track: dict[int, int] = {}  # by the recording's number of an object
    labels = []
    # The mistakes of the detector are drawn when the loop begins, also those at skipped looks.
    for look, labeled in enumerate(labeled_looks(recorded, object_classes, rng)):
        if look in skipped:
            continue
        is_video = bool(recorded.is_video[look])
        tracks = history.add(labeled.detections, recorded.tool[look], is_video=is_video)
        last_track.update(zip(labeled.objects.tolist(), tracks.tolist(), strict=True))
        # The number of false positives is also that of decisions without an object.
        last_track.pop(FALSE_POSITIVE, None)
        if look not in learned:
            continue
        decision = learned[look]
        labels.append(
            LookLabels(
                decisions=len(history) - 1,
                moves=moves.get(decision.move, NO_LABEL),
                tracks=last_track.get(decision.object_number, NO_LABEL),
                stages_done=recorded.done[look],
                passes=passes[look],
                steps_left=steps_left[look],
            )
        )
    columns = np.array(labels, np.int64).T
    by_name = dict(zip(LookLabels._fields, columns, strict=True))
    return EpisodeArrays(history.to_arrays(), goal, **by_name, subgoal_inputs=None)


def _skipped_looks(recorded: ExpertRecording, decisions: Sequence[LookDecision]) -> set[int]:
    """Return the numbers of the looks of a recording that a policy would not have.

    A policy has the regular looks, at multiples of `LOOK_EVERY` control steps, and those of its
    decisions. The expert looks once more where it uses the gripper after a move; a policy decides
    both at once, so this look is skipped.
    """
    between = {look for look in recorded.looks.tolist() if recorded.steps[look] % LOOK_EVERY}
    return between - {decision.look for decision in decisions}


def _counted_looks(recorded: ExpertRecording, rng: np.random.Generator) -> set[int]:
    """Draw up to `COUNTED_LOOKS` numbers of looks after the video, to learn completed stages at."""
    looks_after_video = np.flatnonzero(~recorded.is_video)
    count = min(COUNTED_LOOKS, len(looks_after_video))
    return set(rng.choice(looks_after_video, count, replace=False).tolist())


def to_batch(episodes: Sequence[EpisodeArrays]) -> EpisodeBatch:
    """Return B episodes in one batch: looks padded with zeros, decisions one after the other."""
    looks = {}
    for name in LookArrays._fields:
        looks[name] = _pad([getattr(episode.looks, name) for episode in episodes])
    labels = {}
    for name in LABELS:
        labels[name] = _join([getattr(episode, name) for episode in episodes])
    has_look = [np.ones(len(episode.looks.tool), bool) for episode in episodes]
    numbers = []
    for number, episode in enumerate(episodes):
        numbers.append(np.full(len(episode.decisions), number))
    return EpisodeBatch(
        **looks,
        has_look=_pad(has_look),
        goals=torch.from_numpy(np.stack([episode.goal for episode in episodes])),
        decisions=Decisions(
            episodes=_join(numbers), looks=_join([episode.decisions for episode in episodes])
        ),
        **labels,
        subgoal_inputs=_join_subgoal_inputs(
            [episode.subgoal_inputs for episode in episodes if episode.subgoal_inputs is not None]
        ),
    )


def _join_subgoal_inputs(episodes: Sequence[SubgoalInputs]) -> SubgoalInputBatch | None:
    """Return what hands or planners are given at all decisions; None without subgoals."""
    if not episodes:
        return None
    return SubgoalInputBatch(*map(_join, zip(*episodes, strict=True)))


def _join(arrays: Sequence[NDArray[Any]]) -> torch.Tensor:
    """Return arrays as one tensor, one after the other: [1, 2] and [3] → [1, 2, 3]."""
    return torch.from_numpy(np.concatenate(arrays))


def _pad(arrays: Sequence[NDArray[Any]]) -> torch.Tensor:
    """Return n arrays as one tensor (n, …), each padded to the greatest size along each axis.

    Example: [1, 2] and [3] → [[1, 2], [3, 0]].
    """
    shape = np.max([array.shape for array in arrays], axis=0)
    padded = np.zeros((len(arrays), *shape), arrays[0].dtype)
    for row, array in zip(padded, arrays, strict=True):
        filled_part = tuple(slice(size) for size in array.shape)
        row[filled_part] = array
    return torch.from_numpy(padded)
