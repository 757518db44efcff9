"""What a network is given at each decision: a subgoal, or what a planner named and keeps."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg_learn.policy.body_layers import WIDTH
from roboirg_learn.policy.memories import Decisions, EmbeddedLooks
from roboirg_learn.policy.planner_history import RECENT
from roboirg_learn.policy.subgoals import POINT_NUMBERS

AWAY_SCALE = 5.0
"""Per meter from the point, so that these numbers are about as great as the others."""
NEARNESS = 25.0
"""Per meter: how fast an object counts less, the farther it is from the point."""


class SubgoalInputBatch(NamedTuple):
    """What networks with subgoals are given at N decisions of some episodes.

    Fields are as in `SubgoalInputs`, with N in the place of D.
    """

    context: Tensor
    kept_looks: Tensor
    to_keep: Tensor


class ContextInput(nn.Module):
    """Turns the context of a decision into what is added to its tokens.

    The context is, for hands, the subgoal that they follow; for a planner, what it named before.

    Args:
        numbers: how many the context has.
    """

    def __init__(self, numbers: int) -> None:
        super().__init__()
        self.every = nn.Linear(numbers, WIDTH)
        self.pointed = nn.Linear(4, WIDTH, bias=False)

    def forward(self, context: Tensor, positions: Tensor) -> tuple[Tensor, Tensor]:
        """Return what is added to tokens: of the robot (N, WIDTH), of tracks (N, K, WIDTH).

        Tokens of tracks also get how far their object is from the point that a subgoal names, so
        that the one that is meant stands out.

        Args:
            context: (N, numbers); the last `POINT_NUMBERS` are whether there is a point (1 or 0),
                and its x and y on the table, m.
            positions: (N, K, 2) x and y of the objects on the table, m.
        """
        point = context[:, None, -POINT_NUMBERS:]  # (N, 1, 3): has_point, x, y
        has_point = point[..., :1]
        from_point = positions - point[..., 1:]
        distance = from_point.norm(dim=-1, keepdim=True)
        nearness = (-distance * NEARNESS).exp()  # 1 at the point, 0 far away
        parts = [from_point * AWAY_SCALE, nearness, torch.ones_like(nearness)]
        numbers = torch.cat(parts, -1) * has_point
        to_all = self.every(context)
        return to_all, to_all[:, None] + self.pointed(numbers)


class KeepScore(nn.Module):
    """Scores the recent looks by whether a planner is to keep them for good."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(3 * WIDTH + 1, WIDTH), nn.ReLU(), nn.Linear(WIDTH, 1))

    def forward(self, looks: EmbeddedLooks, decisions: Decisions, now: Tensor) -> Tensor:
        """Return logits (N, RECENT) of keeping each of the `RECENT` looks up to a decision.

        The present look comes last. Looks before the first repeat it; callers ignore their scores.

        Args:
            looks: of the episodes.
            decisions: of these episodes.
            now: (N, WIDTH) the robot's token after all transformer layers.
        """
        present = decisions.looks[:, None]
        recent = present - torch.arange(RECENT - 1, -1, -1)  # (N, RECENT) numbers of looks
        # The mean of what is in sight, which must not depend on how many tracks are padding.
        is_visible = looks.visible[..., None].float()
        visible_tracks = (looks.tracks * is_visible).sum(2) / is_visible.sum(2).clamp(min=1)
        summaries = torch.cat([looks.tool, visible_tracks], -1)
        recent_summaries = summaries[decisions.episodes[:, None], recent.clamp(min=0)]
        robot_token = now[:, None].expand(-1, RECENT, -1)
        is_present = (recent == present).float()[..., None]
        scores: Tensor = self.layers(torch.cat([recent_summaries, robot_token, is_present], -1))
        return scores.squeeze(-1)
