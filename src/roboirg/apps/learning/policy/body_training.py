"""Train the body of a policy: decisions of the expert, as a detector would have seen the way."""

from __future__ import annotations

import json
import random
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from roboirg.apps.learning.listener.listener_net import Vocabulary
from roboirg.apps.learning.policy.body_net import CLOSED, BodyNet, EpisodeBatch
from roboirg.apps.learning.policy.moves import ExpertDecision, Move
from roboirg.apps.learning.policy.policy_data import EpisodeNumbers, to_batch, to_numbers
from roboirg.apps.learning.policy.policy_model import goal_numbers, make_body
from roboirg.apps.learning.policy.policy_plan import PolicyPlan, Recorded
from roboirg.apps.learning.policy.sight import Sight, SightNoise
from roboirg.apps.learning.trainer import Progress, Trainer, batch_count, even_batches
from roboirg.policies.vlm.goal_schema import goal_schema

RATE = 2e-3
BATCH = 16
NEW_NOISE_EVERY = 5
"""Passes after which the noise of the detector is drawn anew."""
HELD_BACK = 10
"""Every tenth episode is not learned from, but shows how learning goes."""


class BodyScore(NamedTuple):
    """How many decisions a body makes as the expert does.

    Attributes:
        epoch: passes so far.
        loss: mean over batches of episodes that it learned from.
        moves: share of right kinds of waypoints in episodes held back.
        things: share of right things in them, given the kind.
    """

    epoch: int
    loss: float
    moves: float
    things: float


def train_body(
    plan: PolicyPlan,
    recorded: Sequence[Recorded],
    decisions: Sequence[Sequence[ExpertDecision]],
    moves: Sequence[Move],
    sight: Sight,
    vocabulary: Vocabulary,
    folder: Path,
    progress: Progress,
) -> BodyNet:
    """Return a body that has learned from recordings, and write how it learned."""
    torch.manual_seed(plan.seed)
    rng, noise_rng = random.Random(plan.seed), np.random.default_rng(plan.seed)
    body = make_body(sight, vocabulary, moves, plan.memory)
    numbers = {move: number for number, move in enumerate(moves)}
    goals = [
        goal_numbers(
            one.episode.task, goal_schema(one.episode.task).answers[one.episode.goal], vocabulary
        )
        for one in recorded
    ]

    def see() -> list[EpisodeNumbers]:
        return [
            to_numbers(one.recording, own, goal, sight, numbers, SightNoise(), noise_rng)
            for one, own, goal in zip(recorded, decisions, goals, strict=True)
        ]

    shown = see()
    count = batch_count([one for number, one in enumerate(shown) if number % HELD_BACK], BATCH)
    trainer = Trainer[EpisodeNumbers](
        body,
        lambda batch: body_loss(body, to_batch(batch)),
        RATE,
        plan.body_epochs * count,
    )
    scores: list[BodyScore] = []
    for epoch in range(plan.body_epochs):
        if epoch and epoch % NEW_NOISE_EVERY == 0:
            shown = see()
        learned = [one for number, one in enumerate(shown) if number % HELD_BACK]
        loss = trainer.run(even_batches(learned, rng, _length, BATCH))
        scores.append(BodyScore(epoch + 1, loss, *score(body, shown[::HELD_BACK])))
        progress("body", epoch + 1, plan.body_epochs)
    body.eval()
    curve = folder / f"body-{plan.memory}-{plan.seed}.json"
    curve.write_text(json.dumps([one._asdict() for one in scores]), encoding="utf-8")
    return body


def _length(one: EpisodeNumbers) -> int:
    return len(one.looks.tool)


def body_loss(body: BodyNet, batch: EpisodeBatch) -> Tensor:
    """Return the loss of kinds of waypoints, and of things given the right kind."""
    kinds, things = body(batch)
    there = batch.moves >= 0
    loss = functional.cross_entropy(kinds[there], batch.moves[there])
    chosen, wanted = _chosen(things, batch)
    if len(wanted):
        loss = loss + functional.cross_entropy(chosen, wanted)
    return loss


def _chosen(things: Tensor, batch: EpisodeBatch) -> tuple[Tensor, Tensor]:
    """Return scores of things (n, K) for the right kinds, and the right things (n,)."""
    at_thing = (batch.moves >= 0) & (batch.things >= 0)
    kinds = batch.moves[at_thing][:, None, None].expand(-1, 1, things.shape[-1])
    scores = things[at_thing].gather(1, kinds)[:, 0]
    wanted = batch.things[at_thing]
    # What is not seen cannot be chosen without memory.
    possible = scores.gather(1, wanted[:, None])[:, 0] > CLOSED / 2
    return scores[possible], wanted[possible]


@torch.no_grad()
def score(body: BodyNet, episodes: Sequence[EpisodeNumbers]) -> tuple[float, float]:
    """Return the shares of right kinds of waypoints and of right things."""
    body.eval()
    right = {"moves": [0, 0], "things": [0, 0]}
    for start in range(0, len(episodes), BATCH):
        batch = to_batch(episodes[start : start + BATCH])
        kinds, things = body(batch)
        there = batch.moves >= 0
        chosen, wanted = _chosen(things, batch)
        for name, found, meant in (
            ("moves", kinds[there].argmax(-1), batch.moves[there]),
            ("things", chosen.argmax(-1), wanted),
        ):
            right[name][0] += int((found == meant).sum())
            right[name][1] += len(meant)
    moves, those = (own / max(1, every) for own, every in right.values())
    return moves, those
