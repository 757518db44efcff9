"""What a policy remembers: one class per kind of memory, all with the same inputs and outputs.

A look is a moment at which the front picture is looked at; a track is an object that is followed
from look to look; a decision is a look at which the next waypoint or subgoal is chosen. A memory
takes the embedded looks of an episode and gives, for each decision, vectors that are added to the
tokens of tracks and robot, or hooks that change the layers of the network. Another memory is one
class with its name in `body_net.MEMORIES`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from roboirg_learn.policy.body_layers import LAYERS, WIDTH, LayerHook

BLOCKED_SCORE = -1e4
"""Logit of what cannot be chosen."""
TIME_FREQUENCIES = 8
"""Frequencies of the sines and cosines that encode a look's number."""
LOOKS_PER_RADIAN = 100.0
"""Looks that the slowest of them takes for one radian."""
NEARNESS_PER_METER = 25.0
"""Attention logits fall by so much for each meter between two objects, before anything is learned
but a factor."""
NO_NEIGHBOR_SCORE = -3.0
"""Attention logit of an extra, empty neighbor, which wins where no object is near."""
UNCONFIRMED_STATE = -2.0
"""Stands for tracks that are not confirmed in a maximum: below all states, which are from -1 to
1."""


class MemoryCache:
    """What a memory that steps from look to look goes on from, so that no look is processed twice.

    The memory that it is given to updates it in place.

    Attributes:
        looks: number of looks processed.
        state: the memory's own state after them, of its own type; None before the first one.
    """

    looks: int = 0
    state: Any = None


class EmbeddedLooks(NamedTuple):
    """The looks of a batch of episodes as a memory reads them; B episodes, T looks, K tracks.

    Attributes:
        tracks: (B, T, K, WIDTH) objects as they are at each look, or were when last seen.
        robot: (B, T, WIDTH) the tool's state, and the goal.
        tool: (B, T, WIDTH) the same without the goal.
        positions: (B, T, K, 2) x and y on the table, m.
        visible: (B, T, K) whether the look shows the object.
        confirmed: (B, T, K) whether it was seen until then, often enough to be no mistake.
        has_look: (B, T) False for padding: the episode is shorter.
        kept_looks: (N, S) numbers of the looks that a planner keeps at each decision, -1 for none;
            None where there is no planner.
        cache: what the memory knows of the first looks; None if all looks are new, and nothing is
            to be kept. Decisions are at looks that are new.
    """

    tracks: Tensor
    robot: Tensor
    tool: Tensor
    positions: Tensor
    visible: Tensor
    confirmed: Tensor
    has_look: Tensor
    kept_looks: Tensor | None = None
    cache: MemoryCache | None = None


class Decisions(NamedTuple):
    """The N decisions of some episodes: those of the first one, then those of the next.

    Attributes:
        episodes: (N,) number of the episode of each.
        looks: (N,) number of the look at which it is made.
    """

    episodes: Tensor
    looks: Tensor


class MemoryOutput(NamedTuple):
    """What a memory adds to the network at N decisions; K tracks.

    Attributes:
        tracks: (N, K, WIDTH) added to the tokens of the tracks; 0 for nothing.
        robot: (N, WIDTH) added to the robot's token; 0 for nothing.
        hooks: one for each transformer layer, of N sequences.
    """

    tracks: Tensor | float = 0.0
    robot: Tensor | float = 0.0
    hooks: Sequence[LayerHook] = (LayerHook(),) * LAYERS


class LookMemory(nn.Module, ABC):
    """A memory of looks: one network, trained with the rest of the policy."""

    @abstractmethod
    def forward(self, looks: EmbeddedLooks, decisions: Decisions) -> MemoryOutput:
        """Return what the memory adds to the network at decisions.

        What it says at a look depends on that look and those before it, never on later ones.

        Args:
            looks: of B episodes.
            decisions: of these episodes.
        """


def values_at_decisions(values: Tensor, decisions: Decisions) -> Tensor:
    """Return values (B, T, …) of looks at those of N decisions, as (N, …).

    Values [[a, b, c]] of one episode with decisions at looks 2 and 0 are [c, a].
    """
    return values[decisions.episodes, decisions.looks]


class MaskedTokens(NamedTuple):
    """Sequences of m tokens (…, m, width), and a mask (…, m): False for padding."""

    values: Tensor
    mask: Tensor


def tokens_at_looks(tokens: MaskedTokens, episodes: Tensor, looks: Tensor) -> MaskedTokens:
    """Return for each of N decisions one sequence with the tokens of the looks that it may use.

    A look has m tokens, and F looks belong to a decision.

    Args:
        tokens: (B, T, m, width), and a mask (B, T, m), of the T looks of B episodes.
        episodes: (N,) number of the episode of each decision.
        looks: (N, F) numbers of looks; below 0 for none, which is masked.

    Returns:
        Tokens (N, F * m, width), and their mask (N, F * m).
    """
    place = episodes[:, None], looks.clamp(min=0)
    mask = tokens.mask[place] & (looks >= 0)[..., None]
    return MaskedTokens(tokens.values[place].flatten(1, 2), mask.flatten(1))


class FrameTokens(nn.Module):
    """Makes the tokens of looks for memories that attend to them.

    They have what was seen and when, without the goal.
    """

    def __init__(self) -> None:
        super().__init__()
        self.mixed = nn.Linear(2 * WIDTH, WIDTH)
        self.time = nn.Linear(2 * TIME_FREQUENCIES, WIDTH)

    def forward(self, looks: EmbeddedLooks) -> MaskedTokens:
        """Return tokens (B, T, 1 + K, WIDTH) of all looks: the robot's, then one for each track.

        Each is mixed with the robot's, and the time of its look is added; objects out of sight and
        looks that the episode does not have are masked.
        """
        tool = looks.tool[:, :, None]
        tokens = torch.cat([tool, looks.tracks], 2)
        mask = torch.cat([looks.has_look[..., None], looks.visible], 2)
        with_tool = torch.cat([tokens, tool.expand_as(tokens)], -1)
        return MaskedTokens(self.mixed(with_tool) + self._times(tokens.shape[1]), mask)

    def _times(self, length: int) -> Tensor:
        """Return the encoded numbers of looks, 0 to length - 1, from sines and cosines.

        It is (T, 1, WIDTH), to be added to all tokens of a look.
        """
        frequencies = LOOKS_PER_RADIAN ** -torch.linspace(0, 1, TIME_FREQUENCIES)
        angles = torch.arange(length)[:, None] * frequencies
        times: Tensor = self.time(torch.cat([angles.sin(), angles.cos()], -1))
        return times[:, None]


class NoMemory(LookMemory):
    """Remembers nothing; the last known positions of objects are part of the present look."""

    def forward(self, looks: EmbeddedLooks, decisions: Decisions) -> MemoryOutput:  # noqa: ARG002
        """Return an output that changes nothing."""
        return MemoryOutput()


class RecurrentState(NamedTuple):
    """What is known after a look: of each object (B, K, WIDTH), and of the scene (B, WIDTH)."""

    tracks: Tensor
    scene: Tensor


class _LookInput(NamedTuple):
    """What changes the recurrent state at one look; B episodes, K tracks.

    Attributes:
        tracks: (B, K, WIDTH) each object's embedding.
        robot: (B, WIDTH) the embedding of robot and goal.
        near: (B, K, K) weights with which an object averages over others nearby.
        is_updated: (B, K, 1) whether the look shows the object.
        confirmed: (B, K, 1) whether it was seen often enough.
        has_look: (B, 1) whether the episode has the look.
    """

    tracks: Tensor
    robot: Tensor
    near: Tensor
    is_updated: Tensor
    confirmed: Tensor
    has_look: Tensor


class RecurrentMemory(LookMemory):
    """A recurrent state for each track, and one for the scene; objects see which others are near.

    In trained files the layers of tracks are called ``thing``, those of the scene ``whole``.
    """

    def __init__(self) -> None:
        super().__init__()
        self.thing = nn.GRUCell(3 * WIDTH, WIDTH)
        self.whole = nn.GRUCell(3 * WIDTH, WIDTH)
        self.nearness = nn.Parameter(torch.tensor(1.0))
        self.pool = nn.Linear(WIDTH, 1)

    def forward(self, looks: EmbeddedLooks, decisions: Decisions) -> MemoryOutput:
        """Return the states after the looks of decisions, stepping over new looks only.

        The state after the looks of earlier calls is in ``looks.cache``, which is brought up to
        date.
        """
        cache = looks.cache or MemoryCache()
        first_new = cache.looks
        states = [self._first_state(looks, cache)]
        for inputs in self._cell_inputs(looks, first_new):
            states.append(self._next_state(states[-1], inputs))
        cache.looks = looks.tracks.shape[1]
        cache.state = states[-1]

        # states[0] is before the new looks.
        places = decisions._replace(looks=decisions.looks - first_new + 1)
        tracks = torch.stack([state.tracks for state in states], 1)
        scenes = torch.stack([state.scene for state in states], 1)
        return MemoryOutput(
            tracks=values_at_decisions(tracks, places), robot=values_at_decisions(scenes, places)
        )

    def _first_state(self, looks: EmbeddedLooks, cache: MemoryCache) -> RecurrentState:
        """Return the state before the new looks: the cached one, with zeros for new tracks."""
        batch, _, count, width = looks.tracks.shape
        if cache.state is None:
            scene = looks.tracks.new_zeros(batch, width)
            return RecurrentState(looks.tracks.new_zeros(batch, count, width), scene)
        tracks, scene = cache.state
        added = count - tracks.shape[1]
        return RecurrentState(functional.pad(tracks, (0, 0, 0, added)), scene)

    def _cell_inputs(self, looks: EmbeddedLooks, first_new: int) -> Iterator[_LookInput]:
        """Yield the input of the cells for each look from `first_new` on.

        What does not depend on the state is computed for all looks at once, which is faster.
        """
        parts = [  # each (B, T, …), in the order of the fields of `_LookInput`
            looks.tracks[:, first_new:],
            looks.robot[:, first_new:],
            self._nearness(looks)[:, first_new:],
            (looks.visible & looks.has_look[..., None])[:, first_new:, :, None],
            looks.confirmed[:, first_new:, :, None],
            looks.has_look[:, first_new:, None],
        ]
        for look in zip(*(part.unbind(1) for part in parts), strict=True):
            yield _LookInput(*look)

    def _next_state(self, state: RecurrentState, look: _LookInput) -> RecurrentState:
        """Return the state after a look: objects first, then the scene, which sums them up.

        Objects out of sight keep their state; so does an episode that has no such look (padding).
        """
        tracks, scene = state
        neighbors = look.near @ tracks
        scene_for_each = scene[:, None].expand_as(tracks)
        track_inputs = torch.cat([look.tracks, neighbors, scene_for_each], -1)
        updated_tracks = self.thing(track_inputs.flatten(0, 1), tracks.flatten(0, 1))
        tracks = torch.where(look.is_updated, updated_tracks.view_as(tracks), tracks)
        mean, maximum = self._summary(tracks, look.confirmed)
        updated_scene = self.whole(torch.cat([look.robot, mean, maximum], -1), scene)
        return RecurrentState(tracks, torch.where(look.has_look, updated_scene, scene))

    def _nearness(self, looks: EmbeddedLooks) -> Tensor:
        """Return the weights (B, T, K, K) with which each object averages over its neighbors.

        A softmax over distances on the table, so near objects count most. The object itself and
        those that were not confirmed at the look before have weight 0. Rows sum to less than 1.
        """
        distances = torch.cdist(looks.positions, looks.positions)  # m
        scores = -(distances * NEARNESS_PER_METER * self.nearness.exp())
        was_confirmed = functional.pad(looks.confirmed[:, :-1], (0, 0, 1, 0))
        is_itself = torch.eye(scores.shape[-1], dtype=torch.bool)
        is_excluded = ~was_confirmed[:, :, None, :] | is_itself
        scores = scores.masked_fill(is_excluded, -math.inf)
        # An extra neighbor, dropped at the end, takes the weight of an object that is alone.
        nobody = scores.new_full((*scores.shape[:-1], 1), NO_NEIGHBOR_SCORE)
        return torch.cat([scores, nobody], -1).softmax(-1)[..., :-1]

    def _summary(self, tracks: Tensor, confirmed: Tensor) -> tuple[Tensor, Tensor]:
        """Return a weighted mean and the maximum over the confirmed objects, each (B, WIDTH).

        Without any, they are 0 and `UNCONFIRMED_STATE`.

        Args:
            tracks: (B, K, WIDTH) states.
            confirmed: (B, K, 1) which of them count.
        """
        scores = self.pool(tracks).masked_fill(~confirmed, BLOCKED_SCORE)
        weights = scores.softmax(1) * confirmed
        mean = weights.transpose(1, 2) @ tracks
        maximum = tracks.masked_fill(~confirmed, UNCONFIRMED_STATE).amax(1)
        return mean[:, 0], maximum
