"""The network that acts: looks, a goal and a memory become a kind of waypoint and a thing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg.apps.learning.listener.listener_net import METERS, waves
from roboirg.apps.learning.policy.memories import HEADS, MEMORIES, WIDTH, Looks, at_looks

LAYERS = 2
WAVES = 5
CLOSED = -1e4
"""Score of a thing that cannot be chosen."""
TOOL_NUMBERS = 7
"""x, y, z, cosine and sine of its angle, a finger's opening, video or not."""
MOST_DONE = 24
"""Stages that are told apart; more count as this many."""


class EpisodeBatch(NamedTuple):
    """Episodes as numbers; B episodes, T looks, K things, D decisions.

    Attributes:
        classes: (B, T, K) numbers of classes.
        places: (B, T, K, 2) m.
        turns: (B, T, K, 2).
        seen: (B, T, K).
        known: (B, T, K).
        tool: (B, T, TOOL_NUMBERS).
        there: (B, T).
        goals: (B, parts) 1 for each part of the goal.
        decisions: (B, D) looks.
        moves: (B, D) kinds of waypoints; -1 where there is none.
        things: (B, D) tracks; -1 where none is chosen.
        done: (B, D) completed stages; -1 where there is no decision.
    """

    classes: Tensor
    places: Tensor
    turns: Tensor
    seen: Tensor
    known: Tensor
    tool: Tensor
    there: Tensor
    goals: Tensor
    decisions: Tensor
    moves: Tensor
    things: Tensor
    done: Tensor


class BodyAnswer(NamedTuple):
    """What a body says at B × D decisions.

    Attributes:
        moves: (B, D, M) logits of kinds of waypoints.
        things: (B, D, M, K) logits of things for each kind.
        done: (B, D, MOST_DONE + 1) logits of how many stages are completed; only learned from.
    """

    moves: Tensor
    things: Tensor
    done: Tensor


class BodyNet(nn.Module):
    """Chooses a kind of waypoint and the thing at whose place it is.

    Args:
        classes: number of classes of things.
        parts: number of parts of goals.
        at_things: for each kind of waypoint, whether it is at a thing.
        memory: a name of `MEMORIES`.
    """

    def __init__(self, classes: int, parts: int, at_things: Sequence[bool], memory: str) -> None:
        super().__init__()
        self.kinds = nn.Embedding(classes, WIDTH)
        self.spot = nn.Sequential(
            nn.Linear(4 * WAVES + 2 + 2 + 4, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH)
        )
        self.tool = nn.Sequential(
            nn.Linear(TOOL_NUMBERS, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH)
        )
        self.unseen = nn.Parameter(torch.randn(WIDTH) * 0.02)
        self.goal = nn.Linear(parts, WIDTH)
        self.memory = MEMORIES[memory]()
        layer = nn.TransformerEncoderLayer(
            WIDTH, HEADS, 2 * WIDTH, dropout=0.0, batch_first=True, norm_first=True
        )
        self.encoder = nn.TransformerEncoder(layer, LAYERS, enable_nested_tensor=False)
        self.move = nn.Linear(WIDTH, len(at_things))
        self.done = nn.Linear(WIDTH, MOST_DONE + 1)
        self.query = nn.Embedding(len(at_things), WIDTH)
        self.key = nn.Linear(WIDTH, WIDTH)
        self.mixed = nn.Linear(WIDTH, WIDTH)

    def forward(self, batch: EpisodeBatch) -> BodyAnswer:
        """Return what is said at the decisions."""
        goal = self.goal(batch.goals)[:, None]
        looks = self._looks(batch, goal)
        remembered = self.memory(looks, batch.decisions)
        things = at_looks(looks.things, batch.decisions) + remembered.things + goal[:, :, None]
        whole = at_looks(looks.whole, batch.decisions) + remembered.whole
        tokens = torch.cat([whole[:, :, None], things], 2).flatten(0, 1)
        closed = ~remembered.can_choose.flatten(0, 1)
        hidden = torch.cat([torch.zeros_like(closed[:, :1]), closed], 1)
        encoded = self.encoder(tokens, src_key_padding_mask=hidden)
        first, rest = encoded[:, 0], encoded[:, 1:]
        queries = self.query.weight[None] + self.mixed(first)[:, None]
        scores = queries @ self.key(rest).transpose(1, 2) / math.sqrt(WIDTH)
        scores = scores.masked_fill(closed[:, None], CLOSED)
        every = self.move(first), scores, self.done(first)
        return BodyAnswer(*(one.unflatten(0, batch.decisions.shape) for one in every))

    def _looks(self, batch: EpisodeBatch, goal: Tensor) -> Looks:
        tool = batch.tool[:, :, None]
        away = batch.places - tool[..., :2]
        apart = torch.cat(
            [away, away.norm(dim=-1, keepdim=True), tool[..., 2:3].expand_as(away[..., :1])], -1
        )
        numbers = torch.cat([waves(batch.places / METERS, WAVES), batch.turns, apart * 5.0], -1)
        things = self.kinds(batch.classes) + self.spot(numbers)
        things = torch.where(batch.seen[..., None], things, things + self.unseen)
        return Looks(
            things, self.tool(batch.tool) + goal, batch.places, batch.seen, batch.known, batch.there
        )
