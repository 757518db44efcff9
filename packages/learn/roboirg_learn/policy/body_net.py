"""The network that acts: looks, a goal and a memory become a move and an object."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg_learn.listener.encoders import METERS, fourier_features
from roboirg_learn.listener.listener_net import transformer
from roboirg_learn.policy.body_layers import HEADS, LAYERS, WIDTH, LayerHook, run_layer
from roboirg_learn.policy.fast_weights import FastWeightMemory
from roboirg_learn.policy.frame_memory import EvenFrameMemory, KeptFrameMemory
from roboirg_learn.policy.memories import (
    BLOCKED_SCORE,
    Decisions,
    EmbeddedLooks,
    LookMemory,
    MemoryCache,
    MemoryOutput,
    NoMemory,
    RecurrentMemory,
    values_at_decisions,
)
from roboirg_learn.policy.policy_plan import KEYFRAME_PLANNER
from roboirg_learn.policy.subgoal_net import ContextInput, KeepScore, SubgoalInputBatch

MEMORIES: Mapping[str, type[LookMemory]] = {
    "none": NoMemory,
    "recurrent": RecurrentMemory,
    "ttt": FastWeightMemory,
    "framesamp": EvenFrameMemory,
    "hands": NoMemory,
    "subgoal": KeptFrameMemory,
    "keyframes": KeptFrameMemory,
}
"""The memory of each network by its option ``--memory``.

The last two are of planners, which name subgoals for the hands, a network without memory.
"""
FREQUENCIES = 5
"""Of the Fourier features of an object's position."""
TOOL_NUMBERS = 7
"""x, y, z, cosine and sine of its angle, a finger's opening, video or not."""
SPOT_NUMBERS = (4 * FREQUENCIES + 2) + 2 + 4
"""An object's position as Fourier features, its yaw code, and where it is from the tool."""
APART_SCALE = 5.0
"""Per meter from the tool, so that these numbers are about as great as the others."""
MOST_COUNTED = 24
"""Greatest count that is predicted, of completed stages and of passes; more count as this many."""


class EpisodeBatch(NamedTuple):
    """A batch of B episodes with T looks and K tracks, padded, and the N decisions of all of them.

    A look is a moment at which the front picture is looked at, a track an object that is followed
    from look to look. From `moves` to `steps_left` are labels, -1 where nothing is learned.

    Attributes:
        classes: (B, T, K) class number of each track.
        positions: (B, T, K, 2) x and y where it was last seen, m.
        yaw_codes: (B, T, K, 2) as `encode_yaws` returns them.
        visible: (B, T, K) whether the look shows it.
        confirmed: (B, T, K) whether it was seen often enough to be no mistake.
        tool: (B, T, TOOL_NUMBERS) state of the tool.
        has_look: (B, T) False for padding.
        goals: (B, parts) 1 for each part of the goal, else 0.
        decisions: episodes and looks at which something is chosen or learned.
        moves: (N,) the right move by number; for planners the right subgoal template.
        tracks: (N,) the right track: of the object that the move or subgoal is at.
        stages_done: (N,) how many stages of the goal are completed.
        passes: (N,) how often a moving cube has passed a target.
        steps_left: (N,) control steps until a wait ends.
        subgoal_inputs: for hands the subgoals that they follow, for planners what they named and
            keep; None for other networks.
    """

    classes: Tensor
    positions: Tensor
    yaw_codes: Tensor
    visible: Tensor
    confirmed: Tensor
    tool: Tensor
    has_look: Tensor
    goals: Tensor
    decisions: Decisions
    moves: Tensor
    tracks: Tensor
    stages_done: Tensor
    passes: Tensor
    steps_left: Tensor
    subgoal_inputs: SubgoalInputBatch | None = None


class BodyAnswer(NamedTuple):
    """The logits of a network at N decisions.

    Attributes:
        moves: (N, M) of each move; for planners, of each subgoal template.
        tracks: (N, M, K) of each track, given the move.
        stages_done: (N, MOST_COUNTED + 1) of how many stages are completed; for training only.
        passes: (N, MOST_COUNTED + 1) the same of passes of a moving cube.
        time_left: (N,) no logits, but log(1 + control steps until a wait ends / `WAIT_STEPS`).
        keep_scores: (N, RECENT) of keeping each recent look; of the planner `KEYFRAME_PLANNER`,
            else None.
    """

    moves: Tensor
    tracks: Tensor
    stages_done: Tensor
    passes: Tensor
    time_left: Tensor
    keep_scores: Tensor | None = None


class BodyNet(nn.Module):
    """Chooses a move (a type of waypoint) and the track of the object that it is at.

    A planner is the same network with subgoal templates in the place of moves.

    Args:
        classes: number of classes of objects.
        parts: how many numbers a goal has.
        at_objects: for each move, whether it is at an object.
        memory: a name of `MEMORIES`.
        context: how many numbers `SubgoalInputBatch.context` has; 0 for a network that gets none.
    """

    def __init__(
        self, classes: int, parts: int, at_objects: Sequence[bool], memory: str, context: int = 0
    ) -> None:
        super().__init__()
        # What is seen becomes tokens: objects by class and position, the robot by tool and goal.
        self.kinds = nn.Embedding(classes, WIDTH)
        self.spot = _two_layers(SPOT_NUMBERS)
        self.tool = _two_layers(TOOL_NUMBERS)
        self.unseen = nn.Parameter(torch.randn(WIDTH) * 0.02)
        self.goal = nn.Linear(parts, WIDTH)
        # What is remembered is added, and the tokens are mixed.
        self.memory = MEMORIES[memory]()
        self.encoder = transformer(WIDTH, HEADS, LAYERS)
        # From the mixed tokens: move, counts, time, and the track for each move.
        self.move = nn.Linear(WIDTH, len(at_objects))
        self.done = nn.Linear(WIDTH, MOST_COUNTED + 1)
        self.passes = nn.Linear(WIDTH, MOST_COUNTED + 1)
        self.time_left = nn.Linear(WIDTH, 1)
        self.query = nn.Embedding(len(at_objects), WIDTH)
        self.key = nn.Linear(WIDTH, WIDTH)
        self.mixed = nn.Linear(WIDTH, WIDTH)
        # Only of hands and planners.
        self.given = ContextInput(context) if context else None
        self.keeps = KeepScore() if memory == KEYFRAME_PLANNER else None

    def forward(self, batch: EpisodeBatch, cache: MemoryCache | None = None) -> BodyAnswer:
        """Return the logits for every decision of a batch.

        At a decision there is one token for the robot with its goal, and one for each track; what
        the memory remembers is added to them, and a transformer mixes them. Whatever the memory,
        the object of any confirmed track can be chosen, in sight or not.

        Args:
            batch: episodes with N decisions.
            cache: what the memory knows of earlier looks, and is updated; None to begin anew.
        """
        goals = self.goal(batch.goals)
        looks = self._looks(batch, goals)._replace(cache=cache)
        memory_output = self.memory(looks, batch.decisions)
        can_choose = values_at_decisions(batch.confirmed, batch.decisions)
        tokens = self._tokens(batch, goals, looks, memory_output)
        tokens = self._attend(tokens, can_choose, memory_output.hooks)

        robot = tokens[:, 0]
        keep_scores = None
        if self.keeps is not None:
            keep_scores = self.keeps(looks, batch.decisions, robot)
        return BodyAnswer(
            moves=self.move(robot),
            tracks=self._track_scores(robot, tokens[:, 1:], can_choose),
            stages_done=self.done(robot),
            passes=self.passes(robot),
            time_left=self.time_left(robot)[..., 0],
            keep_scores=keep_scores,
        )

    def _tokens(
        self, batch: EpisodeBatch, goals: Tensor, looks: EmbeddedLooks, memory_output: MemoryOutput
    ) -> Tensor:
        """Return the tokens (N, 1 + K, WIDTH) of each decision: the robot's, then K tracks'.

        Each is the sum of what is seen, what is remembered, the goal, and for networks with
        subgoals what `ContextInput` makes of these.

        Args:
            batch: the episodes.
            goals: (B, WIDTH) of the episodes, embedded.
            looks: all looks, embedded.
            memory_output: what the memory adds at the decisions.
        """
        decisions = batch.decisions
        goal = goals[decisions.episodes][:, None]
        tracks = values_at_decisions(looks.tracks, decisions) + memory_output.tracks + goal
        robot = values_at_decisions(looks.robot, decisions) + memory_output.robot
        if self.given is not None and batch.subgoal_inputs is not None:
            positions = values_at_decisions(batch.positions, decisions)
            to_robot, to_tracks = self.given(batch.subgoal_inputs.context, positions)
            robot = robot + to_robot
            tracks = tracks + to_tracks
        return torch.cat([robot[:, None], tracks], 1)

    def _attend(self, tokens: Tensor, can_choose: Tensor, hooks: Sequence[LayerHook]) -> Tensor:
        """Return the tokens after all layers; no token attends to objects that cannot be chosen.

        Args:
            tokens: (n, 1 + K, WIDTH), the robot's first.
            can_choose: (n, K) whether the object of each track can be chosen.
            hooks: what the memory does in each layer.
        """
        is_robot = torch.ones_like(can_choose[:, :1])
        is_attended_to = torch.cat([is_robot, can_choose], 1)
        for layer, hook in zip(self.encoder.layers, hooks, strict=True):
            tokens = run_layer(layer, tokens, is_attended_to, hook)
        return tokens

    def _track_scores(self, robot: Tensor, tracks: Tensor, can_choose: Tensor) -> Tensor:
        """Return the score (n, M, K) of each of K tracks for each of M moves.

        It is a scaled dot product: queries are of moves with the robot's token, keys of tracks.

        Args:
            robot: (n, WIDTH) the robot's token.
            tracks: (n, K, WIDTH) the tokens of tracks.
            can_choose: (n, K) False for tracks that get `BLOCKED_SCORE`.
        """
        queries = self.query.weight[None] + self.mixed(robot)[:, None]
        keys = self.key(tracks)
        scores = queries @ keys.transpose(1, 2) / math.sqrt(WIDTH)
        return scores.masked_fill(~can_choose[:, None], BLOCKED_SCORE)

    def _looks(self, batch: EpisodeBatch, goals: Tensor) -> EmbeddedLooks:
        """Return the looks of a batch as the memory reads them; `goals` are (B, WIDTH)."""
        tool = self.tool(batch.tool)
        return EmbeddedLooks(
            tracks=self._embed_tracks(batch),
            robot=tool + goals[:, None],
            tool=tool,
            positions=batch.positions,
            visible=batch.visible,
            confirmed=batch.confirmed,
            has_look=batch.has_look,
            kept_looks=None if batch.subgoal_inputs is None else batch.subgoal_inputs.kept_looks,
        )

    def _embed_tracks(self, batch: EpisodeBatch) -> Tensor:
        """Return the embedding (B, T, K, WIDTH) of each track at each look.

        It has the class, the position on the table and from the tool, and the angle; an object that
        is out of sight is where it was last seen, and is marked by the learned vector `unseen`.
        """
        tool = batch.tool[:, :, None]
        from_tool = batch.positions - tool[..., :2]
        distance = from_tool.norm(dim=-1, keepdim=True)
        height = tool[..., 2:3].expand_as(distance)
        offset = torch.cat([from_tool, distance, height], -1) * APART_SCALE
        position = fourier_features(batch.positions / METERS, FREQUENCIES)
        spot = torch.cat([position, batch.yaw_codes, offset], -1)  # (B, T, K, SPOT_NUMBERS)
        tracks: Tensor = self.kinds(batch.classes) + self.spot(spot)
        return torch.where(batch.visible[..., None], tracks, tracks + self.unseen)


def _two_layers(numbers: int) -> nn.Sequential:
    """Return untrained layers that turn so many numbers into a token: (…, numbers) → (…, WIDTH)."""
    return nn.Sequential(nn.Linear(numbers, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH))
