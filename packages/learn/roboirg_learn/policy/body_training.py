"""Train the body of a policy: decisions of the expert, as a detector would have seen the way.

A body is the network that moves: at each decision it chooses a kind of waypoint and the thing at
whose place it is. A planner is the same network, which chooses subgoals instead of waypoints. The
expert that was recorded knows the simulator; the body sees only what a detector would find.
"""

from __future__ import annotations

import json
import math
import random
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from roboirg.extension.commands import write_atomically
from roboirg_learn.policy.body_net import MOST_DONE, BodyAnswer, BodyNet, EpisodeBatch
from roboirg_learn.policy.memories import BLOCKED_SCORE
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.policy_data import (
    EpisodeNumbers,
    to_batch,
    to_numbers,
)
from roboirg_learn.policy.policy_plan import BodyPlan, Recorded
from roboirg_learn.policy.sight import Sight
from roboirg_learn.policy.subgoal_training import with_planner_inputs
from roboirg_learn.policy.trained_body import GoalLayout, Kind, make_body
from roboirg_learn.trainer import Course, KeptTraining, Progress, Training, even_batches

MOVES = "moves"
THINGS = "things"
DONE = "done"
MEASURES = (MOVES, THINGS, DONE)
"""Shares that are right in episodes held back: kinds of waypoints, things, completed stages."""
RATE = 2e-3
BATCH = 16
COUNT_WEIGHT = 0.5
NEW_NOISE_EVERY = 2
"""Passes after which the noise of the detector is drawn anew."""
HELD_BACK = 10
"""Of so many episodes of a task the second is held back: it only measures how training goes."""


class BodyLesson(NamedTuple):
    """A recorded episode with its decisions: of the body, or of a planner."""

    recorded: Recorded
    decisions: Sequence[LookDecision]


class BodyLayout(NamedTuple):
    """What a body can see, choose and be given.

    Attributes:
        sight: classes of things.
        goals: which number stands for what.
        kinds: of waypoints, or forms of subgoals for a planner.
    """

    sight: Sight
    goals: GoalLayout
    kinds: Sequence[Kind]


def train_body(
    plan: BodyPlan,
    lessons: Sequence[BodyLesson],
    layout: BodyLayout,
    folder: Path,
    progress: Progress,
) -> BodyNet:
    """Train a body or a planner on recordings; write its learning curve next to its file.

    Args:
        plan: memory, seed and number of passes.
        lessons: recorded episodes with the decisions to learn.
        layout: classes, goals, and what it chooses among.
        folder: for the training that is kept after each pass, and the curve as JSON.
        progress: called after each pass.
    """
    course = BodyCourse(plan, lessons, layout)
    path = folder / f"body-{plan.memory}-{plan.seed}.pt"
    kept = KeptTraining(path, course.made_of)
    curve = Training(course).run(partial(progress, "body"), kept)
    rows = [{"epoch": epoch, **measures} for epoch, measures in enumerate(curve, 1)]
    write_atomically(path.with_suffix(".json"), json.dumps(rows))
    return course.net


class BodyCourse(Course[EpisodeNumbers]):
    """A body learns the decisions of the expert; arguments as of `train_body`.

    What a detector would have seen is drawn anew after some passes, so that its mistakes are not
    learned by heart.
    """

    net: BodyNet
    rate = RATE

    def __init__(self, plan: BodyPlan, lessons: Sequence[BodyLesson], layout: BodyLayout) -> None:
        torch.manual_seed(plan.seed)
        self._plan = plan
        self._lessons = lessons
        self._layout = layout
        self._is_held_back = held_back([lesson.recorded.episode.task for lesson in lessons])
        self._learned: list[EpisodeNumbers] = []
        self._held_back: list[EpisodeNumbers] = []
        self.net = make_body(layout.sight, layout.goals, layout.kinds, plan.memory)
        self.epochs = plan.body_epochs
        self.steps = math.ceil(self._is_held_back.count(False) / BATCH)

    @property
    def made_of(self) -> list[Any]:
        """What must be equal for a kept training to go on; its file's name has memory and seed."""
        sight, goals, kinds = self._layout
        return [
            [lesson.recorded.episode.key for lesson in self._lessons],
            [list(kind) for kind in kinds],
            list(sight.classes),
            [list(goals.tasks), list(goals.parts)],
            [self.epochs, HELD_BACK],
        ]

    def batches(self, epoch: int) -> Iterator[list[EpisodeNumbers]]:
        """Yield the episodes to learn from, those of about equal length together."""
        if not self._learned or epoch % NEW_NOISE_EVERY == 0:
            self._draw_noise(epoch // NEW_NOISE_EVERY)
        rng = random.Random(f"{self._plan.seed}/{epoch}")
        return even_batches(self._learned, rng, _length, BATCH)

    def loss(self, batch: Sequence[EpisodeNumbers]) -> Tensor:
        return body_loss(self.net, to_batch(batch))

    def score(self) -> dict[str, float]:
        """Return the shares of right decisions in the episodes that are held back."""
        counts: BodyScore = score(self.net, self._held_back)
        return counts.measures

    def _draw_noise(self, times: int) -> None:
        """Turn all episodes into network input with newly drawn mistakes of the detector.

        Args:
            times: how often that was done before; it seeds the noise.
        """
        rng = np.random.default_rng((self._plan.seed, times))
        self._learned = []
        self._held_back = []
        for lesson, is_held_back in zip(self._lessons, self._is_held_back, strict=True):
            episode = self._seen(lesson, rng)
            group = self._held_back if is_held_back else self._learned
            group.append(episode)

    def _seen(self, lesson: BodyLesson, rng: np.random.Generator) -> EpisodeNumbers:
        """Return an episode as network input, with the subgoals that hands and planners need."""
        sight = self._layout.sight
        kinds = self._layout.kinds
        recorded = lesson.recorded
        goal = self._layout.goals.of_episode(recorded.episode)
        numbers = {kind: number for number, kind in enumerate(kinds)}
        episode = to_numbers(recorded.recording, lesson.decisions, goal, sight, numbers, rng)
        return with_planner_inputs(self._plan.memory, recorded, episode, len(kinds), sight, rng)


def held_back(tasks: Sequence[str]) -> list[bool]:
    """Return for each episode, given its task, whether it is held back from learning.

    It is the second, twelfth, … episode of each task.
    """
    seen: Counter[str] = Counter()
    is_held_back = []
    for task in tasks:
        is_held_back.append(seen[task] % HELD_BACK == 1)
        seen[task] += 1
    return is_held_back


def _length(episode: EpisodeNumbers) -> int:
    """Return the number of looks, so that batches are even."""
    return len(episode.looks.tool)


def body_loss(body: BodyNet, batch: EpisodeBatch) -> Tensor:
    """Return the loss of a batch: of kinds of waypoints, things, and numbers of completed stages.

    Things are scored for the right kind. The number of completed stages is never acted on; it
    teaches the memory at each decision what to keep, as the moves do only where a count ends. A
    planner that chooses looks to keep learns these, too.
    """
    answer: BodyAnswer = body(batch)
    has_move = batch.moves >= 0
    is_decision = batch.done >= 0
    loss = functional.cross_entropy(answer.moves[has_move], batch.moves[has_move])
    done = batch.done[is_decision].clamp(max=MOST_DONE)
    loss = loss + COUNT_WEIGHT * functional.cross_entropy(answer.done[is_decision], done)

    choices = _thing_choices(answer.things, batch)
    if len(choices.right):
        loss = loss + functional.cross_entropy(choices.scores, choices.right)
    if answer.keep_scores is not None and batch.planned is not None:
        loss = loss + _keep_loss(answer.keep_scores, batch.planned.to_keep)
    return loss


def _keep_loss(scores: Tensor, wanted: Tensor) -> Tensor:
    """Return the loss of choosing which of the recent looks to keep.

    Args:
        scores: (B, D, RECENT) logits.
        wanted: (B, D, RECENT) 1 to keep, 0 not to; -1 where nothing is learned.
    """
    has_label = wanted >= 0
    labels = wanted[has_label].float()
    return functional.binary_cross_entropy_with_logits(scores[has_label], labels)


class ThingChoices(NamedTuple):
    """Choices of things at n decisions.

    Attributes:
        scores: (n, K) of the things, for the right kind of waypoint.
        right: (n,) numbers of the right things.
    """

    scores: Tensor
    right: Tensor


def _thing_choices(things: Tensor, batch: EpisodeBatch) -> ThingChoices:
    """Return the scores of things at those decisions whose right thing can be chosen.

    Args:
        things: (B, D, M, K) logits of things for each kind of waypoint; those of the right kind
            are taken.
        batch: with the right kinds and things.
    """
    is_at_thing = (batch.moves >= 0) & (batch.things >= 0)
    kinds = batch.moves[is_at_thing][:, None, None].expand(-1, 1, things.shape[-1])
    scores = things[is_at_thing].gather(1, kinds)[:, 0]
    right = batch.things[is_at_thing]
    # Without memory a thing out of sight is blocked, and nothing could be learned.
    is_possible = scores.gather(1, right[:, None])[:, 0] > BLOCKED_SCORE / 2
    return ThingChoices(scores[is_possible], right[is_possible])


class BodyScore:
    """How many kinds of waypoints, things and counts of completed stages are right."""

    def __init__(self) -> None:
        self._right: Counter[str] = Counter()
        self._all: Counter[str] = Counter()

    def add(self, measure: str, found: Tensor, wanted: Tensor) -> None:
        """Count how many of the found numbers (n,) are as wanted (n,); a name of `MEASURES`."""
        self._right[measure] += int((found == wanted).sum())
        self._all[measure] += len(wanted)

    @property
    def measures(self) -> dict[str, float]:
        """The shares that are right."""
        return {name: self._right[name] / max(1, self._all[name]) for name in MEASURES}


@torch.no_grad()
def score(body: BodyNet, episodes: Sequence[EpisodeNumbers]) -> BodyScore:
    """Return how often a body is right about the kind of waypoint, the thing, and the stages done.

    Args:
        body: the network.
        episodes: with the right decisions.
    """
    body.eval()
    counts = BodyScore()
    for start in range(0, len(episodes), BATCH):
        batch = to_batch(episodes[start : start + BATCH])
        answer: BodyAnswer = body(batch)
        has_move = batch.moves >= 0
        counts.add(MOVES, answer.moves[has_move].argmax(-1), batch.moves[has_move])
        choices = _thing_choices(answer.things, batch)
        counts.add(THINGS, choices.scores.argmax(-1), choices.right)
        is_decision = batch.done >= 0
        done = batch.done[is_decision].clamp(max=MOST_DONE)
        counts.add(DONE, answer.done[is_decision].argmax(-1), done)
    return counts
