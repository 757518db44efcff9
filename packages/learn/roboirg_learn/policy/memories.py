"""What a policy remembers: one class per kind of memory, all with the same inputs and outputs.

A memory takes the embedded looks of an episode and gives, for each decision, a vector for each
thing and one for the whole, or what it does in the layers of the body. Another memory is one class
with its name in `body_net.MEMORIES`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from roboirg_learn.policy.body_layers import WIDTH, Join

BLOCKED_SCORE = -1e4
"""Score of a thing that cannot be chosen."""
TIME_WAVES = 8
"""Sines and cosines that encode a look's number in frames."""
SLOWEST_WAVE = 100.0
"""Looks in a radian of the slowest of them."""
NEARNESS_PER_METER = 25.0
NO_NEIGHBOR_SCORE = -3.0
"""Score of the extra place at which a thing that is alone looks."""
UNKNOWN_THING = -2.0
"""Stands for things that are not known in a maximum."""


class Carried:
    """What a memory that steps from look to look goes on from, so that no look is taken twice.

    Attributes:
        looks: number of looks taken in.
        state: what is known after them; None before the first one.
    """

    looks: int = 0
    state: Any = None


class Looks(NamedTuple):
    """The looks of a batch of episodes; B episodes, T looks, K things.

    Attributes:
        things: (B, T, K, WIDTH) embedded as they are at each look, or were when last seen.
        whole: (B, T, WIDTH) the robot's own state, and the goal.
        tool: (B, T, WIDTH) the same without the goal.
        places: (B, T, K, 2) x and y on the table, m.
        seen: (B, T, K) whether the look shows the thing.
        known: (B, T, K) whether it was seen until then, often enough to be no mistake.
        has_look: (B, T) whether the episode has the look.
        kept_looks: (B, D, S) looks that a planner keeps at each decision, -1 for none.
        carried: what a memory knows of the first looks, and updates; None before the first look.
            Decisions are at looks that are new.
    """

    things: Tensor
    whole: Tensor
    tool: Tensor
    places: Tensor
    seen: Tensor
    known: Tensor
    has_look: Tensor
    kept_looks: Tensor | None = None
    carried: Carried | None = None


class Remembered(NamedTuple):
    """What a memory says at the looks of decisions; B episodes, D decisions, K things.

    Attributes:
        things: (B, D, K, WIDTH).
        whole: (B, D, WIDTH).
        can_choose: (B, D, K) the things that may be chosen.
        joins: what it does in each layer of the body, where it does anything; n is B times D.
    """

    things: Tensor
    whole: Tensor
    can_choose: Tensor
    joins: Sequence[Join] = ()


class LookMemory(nn.Module, ABC):
    """Remembers looks."""

    @abstractmethod
    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        """Return what is remembered at decisions.

        Args:
            looks: of the episodes.
            decisions: (B, D) the numbers of their looks.
        """


def values_at_looks(values: Tensor, decisions: Tensor) -> Tensor:
    """Return the values (B, T, …) at looks (B, D)."""
    rows = torch.arange(len(values), device=values.device)[:, None]
    return values[rows, decisions]


class MaskedTokens(NamedTuple):
    """Tokens (…, m, width), and a mask (…, m): False for padding."""

    values: Tensor
    mask: Tensor


def tokens_at_looks(tokens: MaskedTokens, frames: Tensor) -> MaskedTokens:
    """Return the tokens of some looks for each decision, in sequences; m tokens of each look.

    Args:
        tokens: (B, T, m, width), and (B, T, m).
        frames: (B, D, F) numbers of looks; below 0 for none.

    Returns:
        Tokens (B * D, F * m, width), and which of them there are (B * D, F * m).
    """
    looks = frames.clamp(min=0).flatten(1)
    is_look = (frames >= 0).flatten(1)
    mask = values_at_looks(tokens.mask, looks) & is_look[..., None]
    batch, decisions, count = frames.shape
    shape = batch * decisions, count * mask.shape[-1]
    values = values_at_looks(tokens.values, looks).reshape(*shape, -1)
    return MaskedTokens(values, mask.reshape(shape))


class FrameTokens(nn.Module):
    """The tokens of looks, for memories of frames: what was seen and when, without the goal."""

    def __init__(self) -> None:
        super().__init__()
        self.mixed = nn.Linear(2 * WIDTH, WIDTH)
        self.time = nn.Linear(2 * TIME_WAVES, WIDTH)

    def forward(self, looks: Looks) -> MaskedTokens:
        """Return tokens (B, T, 1 + K, WIDTH) of all looks, the robot's first."""
        tool = looks.tool[:, :, None]
        tokens = torch.cat([tool, looks.things], 2)
        mask = torch.cat([looks.has_look[..., None], looks.seen], 2)
        with_tool = torch.cat([tokens, tool.expand_as(tokens)], -1)
        return MaskedTokens(self.mixed(with_tool) + self._times(tokens.shape[1]), mask)

    def _times(self, length: int) -> Tensor:
        """Return the encoded number of each look (T, 1, WIDTH)."""
        speeds = SLOWEST_WAVE ** -torch.linspace(0, 1, TIME_WAVES)
        angles = torch.arange(length)[:, None] * speeds
        times: Tensor = self.time(torch.cat([angles.sin(), angles.cos()], -1))
        return times[:, None]


def choose_only_seen(looks: Looks, decisions: Tensor, joins: Sequence[Join] = ()) -> Remembered:
    """Return that only what is seen now can be chosen, and what a memory does in each layer."""
    things = torch.zeros_like(values_at_looks(looks.things, decisions))
    whole = torch.zeros_like(values_at_looks(looks.whole, decisions))
    can_choose = values_at_looks(looks.seen & looks.known, decisions)
    return Remembered(things, whole, can_choose, joins)


class NoMemory(LookMemory):
    """Remembers nothing."""

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        return choose_only_seen(looks, decisions)


class RecurrentState(NamedTuple):
    """What is known after a look: of each thing (B, K, WIDTH), and of the whole (B, WIDTH)."""

    things: Tensor
    whole: Tensor


class _LookInput(NamedTuple):
    """What changes the state at one look; B episodes, K things.

    Attributes:
        thing: (B, K, 3 * WIDTH) what the cell of things makes of each.
        whole: (B, 3 * WIDTH) what the cell of the whole makes of it.
        near: (B, K, K) the weights with which things see others.
        is_updated: (B, K, 1) whether the look shows the thing.
        known: (B, K, 1) whether it was seen often enough.
        has_look: (B, 1) whether the episode has the look.
    """

    thing: Tensor
    whole: Tensor
    near: Tensor
    is_updated: Tensor
    known: Tensor
    has_look: Tensor


class RecurrentMemory(LookMemory):
    """A recurrent state for each thing, and one for the whole; each sees which others are near."""

    def __init__(self) -> None:
        super().__init__()
        self.thing = _ThreeInputCell()
        self.whole = _ThreeInputCell()
        self.nearness = nn.Parameter(torch.tensor(1.0))
        self.pool = nn.Linear(WIDTH, 1)

    def forward(self, looks: Looks, decisions: Tensor) -> Remembered:
        carried = looks.carried or Carried()
        first_new = carried.looks
        states = [self._first_state(looks, carried)]
        for inputs in self._cell_inputs(looks, first_new):
            states.append(self._next_state(states[-1], inputs))
        carried.looks = looks.things.shape[1]
        carried.state = states[-1]

        numbers = decisions - first_new + 1
        return Remembered(
            values_at_looks(torch.stack([state.things for state in states], 1), numbers),
            values_at_looks(torch.stack([state.whole for state in states], 1), numbers),
            values_at_looks(looks.known, decisions),
        )

    def _first_state(self, looks: Looks, carried: Carried) -> RecurrentState:
        """Return the state before the new looks, with room for things that are new."""
        batch, _, count, width = looks.things.shape
        if carried.state is None:
            whole = looks.things.new_zeros(batch, width)
            return RecurrentState(looks.things.new_zeros(batch, count, width), whole)
        things, whole = carried.state
        added = count - things.shape[1]
        return RecurrentState(functional.pad(things, (0, 0, 0, added)), whole)

    def _cell_inputs(self, looks: Looks, first_new: int) -> Iterator[_LookInput]:
        """Yield what the cells are given at each new look; computed for all looks at once."""
        parts = [
            self.thing.first(looks.things[:, first_new:]),
            self.whole.first(looks.whole[:, first_new:]),
            self._nearness(looks)[:, first_new:],
            (looks.seen & looks.has_look[..., None])[:, first_new:, :, None],
            looks.known[:, first_new:, :, None],
            looks.has_look[:, first_new:, None],
        ]
        for look in zip(*(part.unbind(1) for part in parts), strict=True):
            yield _LookInput(*look)

    def _next_state(self, state: RecurrentState, look: _LookInput) -> RecurrentState:
        """Return the state after a look."""
        things, whole = state
        around = look.near @ things
        updated = self.thing(look.thing, around, whole[:, None], things)
        things = torch.where(look.is_updated, updated, things)
        mean, most = self._summary(things, look.known)
        updated = self.whole(look.whole, mean, most, whole)
        return RecurrentState(things, torch.where(look.has_look, updated, whole))

    def _nearness(self, looks: Looks) -> Tensor:
        """Return the weights (B, T, K, K) with which things see those known before, by distance."""
        far = torch.cdist(looks.places, looks.places) * NEARNESS_PER_METER * self.nearness.exp()
        was_known = torch.zeros_like(looks.known)
        was_known[:, 1:] = looks.known[:, :-1]
        is_itself = torch.eye(far.shape[-1], dtype=torch.bool)
        is_closed = ~was_known[:, :, None, :] | is_itself
        scores = (-far).masked_fill(is_closed, -math.inf)
        # A thing that is alone sees nothing: an extra place holds zeros.
        alone = far.new_full((*far.shape[:-1], 1), NO_NEIGHBOR_SCORE)
        return torch.cat([scores, alone], -1).softmax(-1)[..., :-1]

    def _summary(self, things: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        """Return a weighted mean and the maximum (B, WIDTH) of things (B, K, …) known (B, K, 1)."""
        scores = self.pool(things).masked_fill(~known, BLOCKED_SCORE)
        weights = scores.softmax(1) * known
        mean = weights.transpose(1, 2) @ things
        most = things.masked_fill(~known, UNKNOWN_THING).amax(1)
        return mean[:, 0], most


class _ThreeInputCell(nn.Module):
    """A gated recurrent unit with three inputs, of which the first is known for all looks."""

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Linear(WIDTH, 3 * WIDTH)
        self.second = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.third = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.own = nn.Linear(WIDTH, 3 * WIDTH)

    def forward(self, of_first: Tensor, second: Tensor, third: Tensor, state: Tensor) -> Tensor:
        """Return the next state (…, WIDTH).

        Args:
            of_first: (…, 3 * WIDTH) what `first` makes of the first input.
            second: (…, WIDTH).
            third: (…, WIDTH).
            state: (…, WIDTH).
        """
        given = of_first + self.second(second) + self.third(third)
        own = self.own(state)
        gates = 2 * WIDTH
        reset, keep = (given[..., :gates] + own[..., :gates]).sigmoid().chunk(2, -1)
        new = (given[..., gates:] + reset * own[..., gates:]).tanh()
        return torch.lerp(new, state, keep)
