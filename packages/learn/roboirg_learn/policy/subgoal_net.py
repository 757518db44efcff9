"""What a network is given at each decision: a subgoal, or what a planner named and keeps."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg_learn.policy.body_layers import WIDTH
from roboirg_learn.policy.memories import Looks, values_at_looks
from roboirg_learn.policy.planner_history import RECENT

AWAY_SCALE = 5.0
"""Per meter from the point, so that these numbers are about as great as the others."""
NEARNESS = 25.0
"""Per meter: how fast a thing counts less, the farther it is from the point."""


class PlannedBatch(NamedTuple):
    """What is given at each decision, padded; fields as in `PlannedNumbers`, with B."""

    context: Tensor
    kept_looks: Tensor
    to_keep: Tensor


class ContextInput(nn.Module):
    """Adds the context to the tokens of a decision, and to things how far the point is.

    Args:
        numbers: of the context.
    """

    def __init__(self, numbers: int) -> None:
        super().__init__()
        self.every = nn.Linear(numbers, WIDTH)
        self.pointed = nn.Linear(4, WIDTH, bias=False)

    def forward(self, context: Tensor, places: Tensor) -> tuple[Tensor, Tensor]:
        """Return what is added to tokens: of the robot (B, D, WIDTH), of things (B, D, K, WIDTH).

        Things also learn how far they are from the point that a subgoal names, so that the one
        that is meant stands out.

        Args:
            context: (B, D, numbers), with the point at the end.
            places: (B, D, K, 2) of the things on the table, m.
        """
        # The last three numbers: whether there is a point (1 or 0), its x and its y, m.
        has_point = context[:, :, None, -3:-2]
        from_point = places - context[:, :, None, -2:]
        nearness = (-from_point.norm(dim=-1, keepdim=True) * NEARNESS).exp()
        parts = [from_point * AWAY_SCALE, nearness, torch.ones_like(nearness)]
        numbers = torch.cat(parts, -1) * has_point
        to_all = self.every(context)
        return to_all, to_all[:, :, None] + self.pointed(numbers)


class KeepScore(nn.Module):
    """Scores the recent looks: which of them is to be kept."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(3 * WIDTH + 1, WIDTH), nn.ReLU(), nn.Linear(WIDTH, 1))

    def forward(self, looks: Looks, decisions: Tensor, now: Tensor) -> Tensor:
        """Return logits (B, D, RECENT) of keeping each of the `RECENT` looks up to a decision.

        The present look comes last. Looks before the first repeat it; callers ignore them.

        Args:
            looks: of the episodes.
            decisions: (B, D) the numbers of the looks at which decisions are made.
            now: (B, D, WIDTH) the robot's token after all layers of the body.
        """
        present = decisions[..., None]
        recent = present - torch.arange(RECENT - 1, -1, -1)
        seen_things = (looks.things * looks.seen[..., None]).mean(2)
        summaries = torch.cat([looks.tool, seen_things], -1)
        flat_summaries = values_at_looks(summaries, recent.clamp(min=0).flatten(1))
        recent_summaries = flat_summaries.reshape(*recent.shape, -1)
        robot_token = now[:, :, None].expand(-1, -1, RECENT, -1)
        is_present = (recent == present).float()[..., None]
        scores: Tensor = self.layers(torch.cat([recent_summaries, robot_token, is_present], -1))
        return scores.squeeze(-1)
