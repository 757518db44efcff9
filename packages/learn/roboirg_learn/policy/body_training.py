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
"""Of every ten episodes of a task, the second shows how training goes and is not learned from."""


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
    """Return a body, or a planner, that has learned from recordings; write how it learned."""
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
        """All that the body depends on, apart from memory and seed."""
        sight, goals, kinds = self._layout
        return [
            [lesson.recorded.episode.key for lesson in self._lessons],
            [list(kind) for kind in kinds],
            list(sight.classes),
            [list(goals.tasks), list(goals.parts)],
            [self.epochs, HELD_BACK],
        ]

    def batches(self, epoch: int) -> Iterator[list[EpisodeNumbers]]:
        if not self._learned or epoch % NEW_NOISE_EVERY == 0:
            self._draw_noise(epoch // NEW_NOISE_EVERY)
        rng = random.Random(f"{self._plan.seed}/{epoch}")
        return even_batches(self._learned, rng, _length, BATCH)

    def loss(self, batch: Sequence[EpisodeNumbers]) -> Tensor:
        return body_loss(self.net, to_batch(batch))

    def score(self) -> dict[str, float]:
        counts: BodyScore = score(self.net, self._held_back)
        return counts.measures

    def _draw_noise(self, times: int) -> None:
        """Let a detector see all episodes anew; `times` before this one."""
        rng = np.random.default_rng((self._plan.seed, times))
        self._learned = []
        self._held_back = []
        for lesson, is_held_back in zip(self._lessons, self._is_held_back, strict=True):
            episode = self._seen(lesson, rng)
            group = self._held_back if is_held_back else self._learned
            group.append(episode)

    def _seen(self, lesson: BodyLesson, rng: np.random.Generator) -> EpisodeNumbers:
        """Return an episode as a detector would have seen it, with the subgoals it needs."""
        sight = self._layout.sight
        kinds = self._layout.kinds
        recorded = lesson.recorded
        goal = self._layout.goals.of_episode(recorded.episode)
        numbers = {kind: number for number, kind in enumerate(kinds)}
        episode = to_numbers(recorded.recording, lesson.decisions, goal, sight, numbers, rng)
        return with_planner_inputs(self._plan.memory, recorded, episode, len(kinds), sight, rng)


def held_back(tasks: Sequence[str]) -> list[bool]:
    """Return which episodes are not learned from, given the task of each."""
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
    """Return the loss of kinds of waypoints, of things given the right kind, and of the count.

    The number of completed stages is not acted on, but at each decision it says what a memory
    should have kept, which the moves show only where a count ends.
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
    """Return the loss of which looks are kept; wanted is 1 or 0, or -1 where there is no look."""
    has_look = wanted >= 0
    return functional.binary_cross_entropy_with_logits(scores[has_look], wanted[has_look].float())


class ThingChoices(NamedTuple):
    """Choices of things at n decisions.

    Attributes:
        scores: (n, K) of the things, for the right kind of waypoint.
        right: (n,) numbers of the right things.
    """

    scores: Tensor
    right: Tensor


def _thing_choices(things: Tensor, batch: EpisodeBatch) -> ThingChoices:
    """Return the choices of things, given the right kinds, where the right thing is possible."""
    is_at_thing = (batch.moves >= 0) & (batch.things >= 0)
    kinds = batch.moves[is_at_thing][:, None, None].expand(-1, 1, things.shape[-1])
    scores = things[is_at_thing].gather(1, kinds)[:, 0]
    right = batch.things[is_at_thing]
    # What is not seen cannot be chosen without memory.
    is_possible = scores.gather(1, right[:, None])[:, 0] > BLOCKED_SCORE / 2
    return ThingChoices(scores[is_possible], right[is_possible])


class BodyScore:
    """How many kinds of waypoints, things and counts of completed stages are right."""

    def __init__(self) -> None:
        self._right: Counter[str] = Counter()
        self._all: Counter[str] = Counter()

    def add(self, measure: str, found: Tensor, wanted: Tensor) -> None:
        """Count what is found, for a name of `MEASURES`."""
        self._right[measure] += int((found == wanted).sum())
        self._all[measure] += len(wanted)

    @property
    def measures(self) -> dict[str, float]:
        """The shares that are right."""
        return {name: self._right[name] / max(1, self._all[name]) for name in MEASURES}


@torch.no_grad()
def score(body: BodyNet, episodes: Sequence[EpisodeNumbers]) -> BodyScore:
    """Return how often a body is right about the decisions of episodes."""
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
