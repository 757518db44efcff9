"""Train the body of a policy: decisions of the expert, as a detector would have seen the way."""

from __future__ import annotations

import json
import math
import random
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from roboirg.extension.commands import write_atomically
from roboirg.extension.episodes import goal_schema
from roboirg_learn.listener.vocabulary import Vocabulary
from roboirg_learn.policy.body_net import MOST_DONE, BodyAnswer, BodyNet, EpisodeBatch
from roboirg_learn.policy.memories import CLOSED
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.policy_data import (
    EpisodeNumbers,
    to_batch,
    to_numbers,
)
from roboirg_learn.policy.policy_model import Kind, goal_numbers, make_body
from roboirg_learn.policy.policy_plan import PolicyPlan, Recorded
from roboirg_learn.policy.sight import Sight
from roboirg_learn.policy.subgoal_training import with_planned
from roboirg_learn.trainer import KeptTraining, Progress, Trainer, even_batches

SHOWN = "moves", "things", "done"
"""Shares that are right in episodes held back: kinds of waypoints, things, completed stages."""
RATE = 2e-3
BATCH = 16
COUNT_WEIGHT = 0.5
NEW_NOISE_EVERY = 2
"""Passes after which the noise of the detector is drawn anew."""
HELD_BACK = 10
"""Of every ten episodes of a task, the second shows how training goes and is not learned from."""


def train_body(
    plan: PolicyPlan,
    recorded: Sequence[Recorded],
    decisions: Sequence[Sequence[LookDecision]],
    moves: Sequence[Kind],
    sight: Sight,
    vocabulary: Vocabulary,
    folder: Path,
    progress: Progress,
) -> BodyNet:
    """Return a body, or a planner, that has learned from recordings; write how it learned."""
    torch.manual_seed(plan.seed)
    body = make_body(sight, vocabulary, moves, plan.memory)
    numbers = {move: number for number, move in enumerate(moves)}
    goals = [
        goal_numbers(
            one.episode.task, goal_schema(one.episode.task).answers[one.episode.goal], vocabulary
        )
        for one in recorded
    ]

    def see(times: int) -> list[EpisodeNumbers]:
        rng = np.random.default_rng((plan.seed, times))
        found = []
        for one, own, goal in zip(recorded, decisions, goals, strict=True):
            episode = to_numbers(one.recording, own, goal, sight, numbers, rng)
            found.append(with_planned(plan.memory, one, episode, len(moves), sight, rng))
        return found

    learned = [not one for one in held_back([one.episode.task for one in recorded])]
    count = math.ceil(sum(learned) / BATCH)
    trainer = Trainer[EpisodeNumbers](
        body,
        lambda batch: body_loss(body, to_batch(batch)),
        RATE,
        plan.body_epochs * count,
    )
    path = folder / f"body-{plan.memory}-{plan.seed}.pt"
    shown: list[EpisodeNumbers] = []

    def mixed(number: int) -> Iterator[list[EpisodeNumbers]]:
        if not shown or number % NEW_NOISE_EVERY == 0:
            shown[:] = see(number // NEW_NOISE_EVERY)
        rng = random.Random(f"{plan.seed}/{number}")
        return even_batches(list(compress(shown, learned)), rng, _length, BATCH)

    def score_unseen() -> dict[str, float]:
        unseen = [one for one, is_learned in zip(shown, learned, strict=True) if not is_learned]
        return dict(zip(SHOWN, score(body, unseen), strict=True))

    found = trainer.learn(
        plan.body_epochs,
        mixed,
        partial(progress, "body"),
        KeptTraining(path, _made_of(plan, recorded, moves, sight, vocabulary)),
        score_unseen,
    )
    curve = [{"epoch": epoch, **one} for epoch, one in enumerate(found, 1)]
    write_atomically(path.with_suffix(".json"), json.dumps(curve))
    return body


def held_back(tasks: Sequence[str]) -> list[bool]:
    """Return which episodes are not learned from, given the task of each."""
    before: Counter[str] = Counter()
    found = []
    for task in tasks:
        found.append(before[task] % HELD_BACK == 1)
        before[task] += 1
    return found


def _made_of(
    plan: PolicyPlan,
    recorded: Sequence[Recorded],
    moves: Sequence[Kind],
    sight: Sight,
    vocabulary: Vocabulary,
) -> list[Any]:
    """Return what a body depends on; the words are not among it."""
    return [
        [one.episode.key for one in recorded],
        [list(move) for move in moves],
        list(sight.classes),
        [list(vocabulary.tasks), list(vocabulary.parts)],
        [plan.body_epochs, HELD_BACK],
    ]


def _length(one: EpisodeNumbers) -> int:
    return len(one.looks.tool)


def body_loss(body: BodyNet, batch: EpisodeBatch) -> Tensor:
    """Return the loss of kinds of waypoints, of things given the right kind, and of the count.

    The number of completed stages is not acted on, but at each decision it says what a memory
    should have kept, which the moves show only where a count ends.
    """
    answer: BodyAnswer = body(batch)
    there, decided = batch.moves >= 0, batch.done >= 0
    loss = functional.cross_entropy(answer.moves[there], batch.moves[there])
    done = batch.done[decided].clamp(max=MOST_DONE)
    loss = loss + COUNT_WEIGHT * functional.cross_entropy(answer.done[decided], done)
    chosen, wanted = _chosen(answer.things, batch)
    if len(wanted):
        loss = loss + functional.cross_entropy(chosen, wanted)
    if answer.keys is not None and batch.planned is not None:
        shown = batch.planned.keys >= 0
        wanted_keys = batch.planned.keys[shown].float()
        loss = loss + functional.binary_cross_entropy_with_logits(answer.keys[shown], wanted_keys)
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
def score(body: BodyNet, episodes: Sequence[EpisodeNumbers]) -> tuple[float, ...]:
    """Return the shares of right kinds of waypoints, of right things and of right counts."""
    body.eval()
    right = {"moves": [0, 0], "things": [0, 0], "done": [0, 0]}
    for start in range(0, len(episodes), BATCH):
        batch = to_batch(episodes[start : start + BATCH])
        answer: BodyAnswer = body(batch)
        there, decided = batch.moves >= 0, batch.done >= 0
        chosen, wanted = _chosen(answer.things, batch)
        for name, found, meant in (
            ("moves", answer.moves[there].argmax(-1), batch.moves[there]),
            ("things", chosen.argmax(-1), wanted),
            ("done", answer.done[decided].argmax(-1), batch.done[decided].clamp(max=MOST_DONE)),
        ):
            right[name][0] += int((found == meant).sum())
            right[name][1] += len(meant)
    return tuple(own / max(1, every) for own, every in right.values())
