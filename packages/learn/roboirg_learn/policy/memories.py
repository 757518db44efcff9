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
"""Logit of a thing that cannot be chosen."""
TIME_WAVES = 8
"""Sines and cosines that encode a look's number in frames."""
SLOWEST_WAVE = 100.0
"""Looks that the slowest of them takes for one radian."""
NEARNESS_PER_METER = 25.0
NO_NEIGHBOR_SCORE = -3.0
"""Attention logit of an extra, empty neighbor, which wins where no thing is near."""
UNKNOWN_THING = -2.0
"""Value of unknown things in a maximum: below all states, which are from -1 to 1."""


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
        joins: one for each layer of the body, whose attention or input it changes; empty if the
            memory changes none. Their n is B times D.
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
    """Return values (B, T, …) at the looks whose numbers are given (B, D), as (B, D, …)."""
    rows = torch.arange(len(values), device=values.device)[:, None]
    return values[rows, decisions]


class MaskedTokens(NamedTuple):
    """Tokens (…, m, width), and a mask (…, m): False for padding."""

    values: Tensor
    mask: Tensor


def tokens_at_looks(tokens: MaskedTokens, frames: Tensor) -> MaskedTokens:
    """Return for each decision one sequence with the tokens of the looks that it may use.

    B episodes with D decisions and T looks; a look has m tokens, and F looks belong to a decision.

    Args:
        tokens: (B, T, m, width), and (B, T, m).
        frames: (B, D, F) numbers of looks; below 0 for none, which is masked.

    Returns:
        Tokens (B * D, F * m, width), and their mask (B * D, F * m).
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
        """Return tokens (B, T, 1 + K, WIDTH) of all looks: the robot's, then one for each thing.

        Each is mixed with the robot's own, and has its time added; things out of sight are masked.
        """
        tool = looks.tool[:, :, None]
        tokens = torch.cat([tool, looks.things], 2)
        mask = torch.cat([looks.has_look[..., None], looks.seen], 2)
        with_tool = torch.cat([tokens, tool.expand_as(tokens)], -1)
        return MaskedTokens(self.mixed(with_tool) + self._times(tokens.shape[1]), mask)

    def _times(self, length: int) -> Tensor:
        """Return the time of each look, its number, as sines and cosines (T, 1, WIDTH)."""
        speeds = SLOWEST_WAVE ** -torch.linspace(0, 1, TIME_WAVES)
        angles = torch.arange(length)[:, None] * speeds
        times: Tensor = self.time(torch.cat([angles.sin(), angles.cos()], -1))
        return times[:, None]


def choose_only_seen(looks: Looks, decisions: Tensor, joins: Sequence[Join] = ()) -> Remembered:
    """Return an output that adds no vectors and lets only things in sight be chosen.

    Args:
        looks: of the episodes.
        decisions: (B, D) numbers of looks.
        joins: what a memory does in each layer instead.
    """
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
        thing: (B, K, 3 * WIDTH) each thing's embedding, projected for the gates of its cell.
        whole: (B, 3 * WIDTH) the same of the robot and the goal.
        near: (B, K, K) weights with which a thing averages over others nearby.
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
        """Return the states after the looks of decisions (B, D), stepping over new looks only.

        Looks of an earlier call are in ``looks.carried``, which is brought up to date. Any thing
        that was seen often enough may be chosen, also out of sight.
        """
        carried = looks.carried or Carried()
        first_new = carried.looks
        states = [self._first_state(looks, carried)]
        for inputs in self._cell_inputs(looks, first_new):
            states.append(self._next_state(states[-1], inputs))
        carried.looks = looks.things.shape[1]
        carried.state = states[-1]

        numbers = decisions - first_new + 1  # states[0] is before the new looks
        return Remembered(
            values_at_looks(torch.stack([state.things for state in states], 1), numbers),
            values_at_looks(torch.stack([state.whole for state in states], 1), numbers),
            values_at_looks(looks.known, decisions),
        )

    def _first_state(self, looks: Looks, carried: Carried) -> RecurrentState:
        """Return the state before the new looks: what was carried, with zeros for new things."""
        batch, _, count, width = looks.things.shape
        if carried.state is None:
            whole = looks.things.new_zeros(batch, width)
            return RecurrentState(looks.things.new_zeros(batch, count, width), whole)
        things, whole = carried.state
        added = count - things.shape[1]
        return RecurrentState(functional.pad(things, (0, 0, 0, added)), whole)

    def _cell_inputs(self, looks: Looks, first_new: int) -> Iterator[_LookInput]:
        """Yield the input of the cells for each look from `first_new` on.

        What does not depend on the state is computed for all looks at once, which is faster.
        """
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
        """Return the state after a look: things first, then the whole, which sums them up.

        Things out of sight keep their state; so does an episode that has no such look (padding).
        """
        things, whole = state
        neighbors = look.near @ things
        updated_things = self.thing(look.thing, neighbors, whole[:, None], things)
        things = torch.where(look.is_updated, updated_things, things)
        mean, maximum = self._summary(things, look.known)
        updated_whole = self.whole(look.whole, mean, maximum, whole)
        return RecurrentState(things, torch.where(look.has_look, updated_whole, whole))

    def _nearness(self, looks: Looks) -> Tensor:
        """Return the weights (B, T, K, K) with which each thing averages over its neighbors.

        A softmax over distances on the table, so near things count most. Itself and things that
        were not known at the look before have weight 0. Rows sum to less than 1.
        """
        distances = torch.cdist(looks.places, looks.places)  # m
        far = distances * NEARNESS_PER_METER * self.nearness.exp()
        was_known = torch.zeros_like(looks.known)
        was_known[:, 1:] = looks.known[:, :-1]
        is_itself = torch.eye(far.shape[-1], dtype=torch.bool)
        is_excluded = ~was_known[:, :, None, :] | is_itself
        scores = (-far).masked_fill(is_excluded, -math.inf)
        # An extra neighbor, dropped at the end, takes the weight of a thing that is alone.
        nobody = far.new_full((*far.shape[:-1], 1), NO_NEIGHBOR_SCORE)
        return torch.cat([scores, nobody], -1).softmax(-1)[..., :-1]

    def _summary(self, things: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        """Return a weighted mean and the maximum over the known things, each (B, WIDTH).

        Args:
            things: (B, K, WIDTH) states.
            known: (B, K, 1) which of them count.
        """
        scores = self.pool(things).masked_fill(~known, BLOCKED_SCORE)
        weights = scores.softmax(1) * known
        mean = weights.transpose(1, 2) @ things
        maximum = things.masked_fill(~known, UNKNOWN_THING).amax(1)
        return mean[:, 0], maximum


class _ThreeInputCell(nn.Module):
    """A gated recurrent unit (GRU) with three inputs.

    The first does not depend on the state, so callers apply `first` to all looks at once.
    """

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Linear(WIDTH, 3 * WIDTH)
        self.second = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.third = nn.Linear(WIDTH, 3 * WIDTH, bias=False)
        self.own = nn.Linear(WIDTH, 3 * WIDTH)

    def forward(self, of_first: Tensor, second: Tensor, third: Tensor, state: Tensor) -> Tensor:
        """Return the next state (…, WIDTH) of a gated recurrent unit.

        Args:
            of_first: (…, 3 * WIDTH) the first input after the layer `first`.
            second: (…, WIDTH) second input.
            third: (…, WIDTH) third input.
            state: (…, WIDTH) the state before.
        """
        # Of each 3 * WIDTH numbers: reset gate, keep gate, candidate.
        from_inputs = of_first + self.second(second) + self.third(third)
        from_state = self.own(state)
        gates = 2 * WIDTH
        reset, keep = (from_inputs[..., :gates] + from_state[..., :gates]).sigmoid().chunk(2, -1)
        candidate = (from_inputs[..., gates:] + reset * from_state[..., gates:]).tanh()
        return torch.lerp(candidate, state, keep)
