"""The network that acts: looks, a goal and a memory become a kind of waypoint and a thing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg_learn.listener.encoders import METERS, waves
from roboirg_learn.listener.listener_net import transformer
from roboirg_learn.policy.body_layers import HEADS, LAYERS, WIDTH, Join, run_layer
from roboirg_learn.policy.fast_weights import FastWeightMemory
from roboirg_learn.policy.frame_memory import EvenFrameMemory, KeptFrameMemory
from roboirg_learn.policy.memories import (
    CLOSED,
    Carried,
    LookMemory,
    Looks,
    NoMemory,
    RecurrentMemory,
    at_looks,
)
from roboirg_learn.policy.policy_plan import CHOOSES
from roboirg_learn.policy.subgoal_net import ContextInput, KeepScore, PlannedBatch

MEMORIES: Mapping[str, type[LookMemory]] = {
    "none": NoMemory,
    "recurrent": RecurrentMemory,
    "ttt": FastWeightMemory,
    "framesamp": EvenFrameMemory,
    "hands": NoMemory,
    "subgoal": KeptFrameMemory,
    "keyframes": KeptFrameMemory,
}
"""What bodies remember, and what planners do: the last two name subgoals, which hands follow."""
WAVES = 5
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
        planned: the subgoals, for hands; or what a planner named and keeps.
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
    planned: PlannedBatch | None = None


class BodyAnswer(NamedTuple):
    """What a body says at B × D decisions.

    Attributes:
        moves: (B, D, M) logits of kinds of waypoints.
        things: (B, D, M, K) logits of things for each kind.
        done: (B, D, MOST_DONE + 1) logits of how many stages are completed; only learned from.
        keys: (B, D, RECENT) logits of keeping each of the recent looks; of `CHOOSES` only.
    """

    moves: Tensor
    things: Tensor
    done: Tensor
    keys: Tensor | None = None


class BodyNet(nn.Module):
    """Chooses a kind of waypoint and the thing at whose place it is.

    Args:
        classes: number of classes of things.
        parts: number of parts of goals.
        at_things: for each kind of waypoint, whether it is at a thing.
        memory: a name of `MEMORIES`.
        context: how many numbers it is given at each decision.
    """

    def __init__(
        self, classes: int, parts: int, at_things: Sequence[bool], memory: str, context: int = 0
    ) -> None:
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
        self.encoder = transformer(WIDTH, HEADS, LAYERS)
        self.move = nn.Linear(WIDTH, len(at_things))
        self.done = nn.Linear(WIDTH, MOST_DONE + 1)
        self.query = nn.Embedding(len(at_things), WIDTH)
        self.key = nn.Linear(WIDTH, WIDTH)
        self.mixed = nn.Linear(WIDTH, WIDTH)
        self.given = ContextInput(context) if context else None
        self.keeps = KeepScore() if memory == CHOOSES else None

    def forward(self, batch: EpisodeBatch, carried: Carried | None = None) -> BodyAnswer:
        """Return what is said at the decisions; what is carried is as in `Looks`."""
        goal = self.goal(batch.goals)[:, None]
        looks = self._looks(batch, goal)._replace(carried=carried)
        remembered = self.memory(looks, batch.decisions)
        things = at_looks(looks.things, batch.decisions) + remembered.things + goal[:, :, None]
        whole = at_looks(looks.whole, batch.decisions) + remembered.whole
        if self.given is not None and batch.planned is not None:
            places = at_looks(batch.places, batch.decisions)
            of_whole, of_things = self.given(batch.planned.context, places)
            whole, things = whole + of_whole, things + of_things
        tokens = torch.cat([whole[:, :, None], things], 2).flatten(0, 1)
        closed = ~remembered.can_choose.flatten(0, 1)
        hidden = torch.cat([torch.zeros_like(closed[:, :1]), closed], 1)
        joins = remembered.joins or [Join()] * LAYERS
        for layer, join in zip(self.encoder.layers, joins, strict=True):
            tokens = run_layer(layer, tokens, ~hidden, join)
        first, rest = tokens[:, 0], tokens[:, 1:]
        queries = self.query.weight[None] + self.mixed(first)[:, None]
        scores = queries @ self.key(rest).transpose(1, 2) / math.sqrt(WIDTH)
        scores = scores.masked_fill(closed[:, None], CLOSED)
        shape = batch.decisions.shape
        every = self.move(first), scores, self.done(first)
        answer = BodyAnswer(*(one.reshape(*shape, *one.shape[1:]) for one in every))
        if self.keeps is None:
            return answer
        keys = self.keeps(looks, batch.decisions, first.reshape(*shape, -1))
        return answer._replace(keys=keys)

    def _looks(self, batch: EpisodeBatch, goal: Tensor) -> Looks:
        tool = batch.tool[:, :, None]
        away = batch.places - tool[..., :2]
        apart = torch.cat(
            [away, away.norm(dim=-1, keepdim=True), tool[..., 2:3].expand_as(away[..., :1])], -1
        )
        numbers = torch.cat([waves(batch.places / METERS, WAVES), batch.turns, apart * 5.0], -1)
        things = self.kinds(batch.classes) + self.spot(numbers)
        things = torch.where(batch.seen[..., None], things, things + self.unseen)
        own = self.tool(batch.tool)
        kept = None if batch.planned is None else batch.planned.kept
        return Looks(
            things, own + goal, own, batch.places, batch.seen, batch.known, batch.there, kept
        )
