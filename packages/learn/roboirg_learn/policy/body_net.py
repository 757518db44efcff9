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
    BLOCKED_SCORE,
    Carried,
    LookMemory,
    Looks,
    NoMemory,
    RecurrentMemory,
    Remembered,
    values_at_looks,
)
from roboirg_learn.policy.policy_plan import KEYFRAME_PLANNER
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
SPOT_NUMBERS = (4 * WAVES + 2) + 2 + 4
"""A thing's place as waves, its angle, and where it is from the tool."""
APART_SCALE = 5.0
"""Per meter from the tool, so that these numbers are about as great as the others."""
MOST_DONE = 24
"""Greatest count of completed stages that is predicted; more count as this many."""


class EpisodeBatch(NamedTuple):
    """Episodes as numbers; B episodes, T looks, K things, D decisions.

    Attributes:
        classes: (B, T, K) numbers of classes.
        places: (B, T, K, 2) m.
        turns: (B, T, K, 2).
        seen: (B, T, K).
        known: (B, T, K).
        tool: (B, T, TOOL_NUMBERS).
        has_look: (B, T).
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
    has_look: Tensor
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
        keep_scores: (B, D, RECENT) logits of keeping each recent look; of the planner
            `KEYFRAME_PLANNER` only.
    """

    moves: Tensor
    things: Tensor
    done: Tensor
    keep_scores: Tensor | None = None


class BodyNet(nn.Module):
    """Chooses a kind of waypoint and the thing at whose place it is.

    Args:
        classes: number of classes of things.
        parts: number of parts of goals.
        at_things: for each kind of waypoint, whether it is at a thing.
        memory: a name of `MEMORIES`.
        context: how many numbers `PlannedBatch.context` has; 0 for a body that gets none.
    """

    def __init__(
        self, classes: int, parts: int, at_things: Sequence[bool], memory: str, context: int = 0
    ) -> None:
        super().__init__()
        # What is seen becomes tokens: things by class and place, the robot by its tool and goal.
        self.kinds = nn.Embedding(classes, WIDTH)
        self.spot = _two_layers(SPOT_NUMBERS)
        self.tool = _two_layers(TOOL_NUMBERS)
        self.unseen = nn.Parameter(torch.randn(WIDTH) * 0.02)
        self.goal = nn.Linear(parts, WIDTH)
        # What is remembered is added, and the tokens are mixed.
        self.memory = MEMORIES[memory]()
        self.encoder = transformer(WIDTH, HEADS, LAYERS)
        # From the mixed tokens: kind of waypoint, completed stages, and the thing for each kind.
        self.move = nn.Linear(WIDTH, len(at_things))
        self.done = nn.Linear(WIDTH, MOST_DONE + 1)
        self.query = nn.Embedding(len(at_things), WIDTH)
        self.key = nn.Linear(WIDTH, WIDTH)
        self.mixed = nn.Linear(WIDTH, WIDTH)
        # Only of hands and planners.
        self.given = ContextInput(context) if context else None
        self.keeps = KeepScore() if memory == KEYFRAME_PLANNER else None

    def forward(self, batch: EpisodeBatch, carried: Carried | None = None) -> BodyAnswer:
        """Return the scores (logits) for every decision of a batch.

        At a decision there is one token for the robot with its goal, and one for each thing; what
        the memory remembers is added to them, and a transformer mixes them.

        Args:
            batch: B episodes with D decisions.
            carried: what the memory knows of earlier looks of one episode; None to begin anew.
        """
        goal = self.goal(batch.goals)[:, None]
        looks = self._looks(batch, goal)._replace(carried=carried)
        remembered = self.memory(looks, batch.decisions)
        can_choose = remembered.can_choose.flatten(0, 1)
        tokens = self._tokens(batch, goal, looks, remembered)
        tokens = self._attend(tokens, can_choose, remembered.joins)

        robot = tokens[:, 0]
        shape = batch.decisions.shape
        things = self._thing_scores(robot, tokens[:, 1:], can_choose).unflatten(0, shape)
        moves = self.move(robot).unflatten(0, shape)
        done = self.done(robot).unflatten(0, shape)
        keep_scores = None
        if self.keeps is not None:
            keep_scores = self.keeps(looks, batch.decisions, robot.unflatten(0, shape))
        return BodyAnswer(moves, things, done, keep_scores)

    def _tokens(
        self, batch: EpisodeBatch, goal: Tensor, looks: Looks, remembered: Remembered
    ) -> Tensor:
        """Return the tokens (B * D, 1 + K, WIDTH) of each decision: the robot's, then K things.

        Each is the sum of what is seen, what is remembered, the goal, and for planners and bodies
        that follow subgoals the planner's context.

        Args:
            batch: the episodes.
            goal: (B, 1, WIDTH) embedded.
            looks: all looks, embedded.
            remembered: what the memory adds at the decisions.
        """
        decisions = batch.decisions
        things = values_at_looks(looks.things, decisions) + remembered.things + goal[:, :, None]
        whole = values_at_looks(looks.whole, decisions) + remembered.whole
        if self.given is not None and batch.planned is not None:
            places = values_at_looks(batch.places, decisions)
            to_whole, to_things = self.given(batch.planned.context, places)
            whole = whole + to_whole
            things = things + to_things
        return torch.cat([whole[:, :, None], things], 2).flatten(0, 1)

    def _attend(self, tokens: Tensor, can_choose: Tensor, joins: Sequence[Join]) -> Tensor:
        """Return the tokens after all layers; no token attends to things that cannot be chosen.

        Args:
            tokens: (n, 1 + K, WIDTH), the robot's first.
            can_choose: (n, K).
            joins: what the memory does in each layer; may be empty.
        """
        is_robot = torch.ones_like(can_choose[:, :1])
        is_seen = torch.cat([is_robot, can_choose], 1)
        for number, layer in enumerate(self.encoder.layers):
            join = joins[number] if joins else Join()
            tokens = run_layer(layer, tokens, is_seen, join)
        return tokens

    def _thing_scores(self, robot: Tensor, things: Tensor, can_choose: Tensor) -> Tensor:
        """Return the score (n, M, K) of each of K things for each of M kinds of waypoints.

        Args:
            robot: (n, WIDTH) the robot's token.
            things: (n, K, WIDTH) the tokens of things.
            can_choose: (n, K); the others get `BLOCKED_SCORE`.
        """
        queries = self.query.weight[None] + self.mixed(robot)[:, None]
        keys = self.key(things)
        scores = queries @ keys.transpose(1, 2) / math.sqrt(WIDTH)
        return scores.masked_fill(~can_choose[:, None], BLOCKED_SCORE)

    def _looks(self, batch: EpisodeBatch, goal: Tensor) -> Looks:
        """Return the looks of a batch as the memory reads them; `goal` is (B, 1, WIDTH)."""
        tool = self.tool(batch.tool)
        return Looks(
            things=self._things(batch),
            whole=tool + goal,
            tool=tool,
            places=batch.places,
            seen=batch.seen,
            known=batch.known,
            has_look=batch.has_look,
            kept_looks=None if batch.planned is None else batch.planned.kept_looks,
        )

    def _things(self, batch: EpisodeBatch) -> Tensor:
        """Return the embedding (B, T, K, WIDTH) of each thing at each look.

        It has the class, the place on the table and from the tool, and the angle; one that is out
        of sight is where it was last seen, and is marked.
        """
        tool = batch.tool[:, :, None]
        from_tool = batch.places - tool[..., :2]
        distance = from_tool.norm(dim=-1, keepdim=True)
        height = tool[..., 2:3].expand_as(distance)
        offset = torch.cat([from_tool, distance, height], -1) * APART_SCALE
        numbers = torch.cat([waves(batch.places / METERS, WAVES), batch.turns, offset], -1)
        things: Tensor = self.kinds(batch.classes) + self.spot(numbers)
        return torch.where(batch.seen[..., None], things, things + self.unseen)


def _two_layers(numbers: int) -> nn.Sequential:
    """Return untrained layers from some numbers to a token."""
    return nn.Sequential(nn.Linear(numbers, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH))
