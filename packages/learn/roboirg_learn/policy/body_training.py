"""Train the network of a policy by imitation: the expert's decisions from what a detector sees.

A body's network chooses, at each decision, a move (a type of waypoint) and the object that it is
at. A planner is the same network, which chooses subgoal templates instead of moves. The expert that
was recorded knows the simulator; the network sees only what a detector would find.
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
from roboirg_learn.policy.body_net import BodyAnswer, BodyNet, EpisodeBatch
from roboirg_learn.policy.memories import BLOCKED_SCORE
from roboirg_learn.policy.moves import LookDecision
from roboirg_learn.policy.policy_data import (
    EpisodeArrays,
    to_arrays,
    to_batch,
)
from roboirg_learn.policy.policy_plan import BodyPlan, Recorded
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.subgoal_training import with_planner_inputs
from roboirg_learn.policy.timing import WAIT_STEPS
from roboirg_learn.policy.trained_body import Choice, GoalLayout, make_body
from roboirg_learn.trainer import Checkpoint, Course, Progress, Training, even_batches

MOVES = "moves"
THINGS = "things"
DONE = "done"
PASSES = "passes"
LOSS_WEIGHTS = {MOVES: 1.0, THINGS: 1.0, DONE: 0.5, PASSES: 0.5}
"""Weights in the loss of what is chosen (moves, objects) and of what is counted (completed stages,
passes of a moving cube). In validation episodes the share of right ones is measured."""
RATE = 2e-3
BATCH = 16
LARGE_ERROR = 0.1
"""Of a time left; the loss grows with the square of smaller errors, else evenly."""
NEW_NOISE_EVERY = 2
"""Passes after which the noise of the detector is drawn anew."""
VALIDATION_EVERY = 10
"""Of so many episodes of a task the second is for validation: nothing is learned from it."""


class BodyExample(NamedTuple):
    """A recorded episode with the decisions to learn: of a body, or of a planner."""

    recorded: Recorded
    decisions: Sequence[LookDecision]


class BodyLayout(NamedTuple):
    """What the inputs and outputs of a network stand for.

    Attributes:
        object_classes: classes of objects that it can see.
        goals: which number of a goal stands for what.
        choices: the moves, or for a planner the subgoal templates, that it chooses among.
    """

    object_classes: ObjectClasses
    goals: GoalLayout
    choices: Sequence[Choice]


def train_body(
    plan: BodyPlan,
    examples: Sequence[BodyExample],
    layout: BodyLayout,
    folder: Path,
    progress: Progress,
) -> BodyNet:
    """Train a body's network or a planner on recordings; write its learning curve as JSON.

    Args:
        plan: memory, seed and number of passes.
        examples: recorded episodes with the decisions to learn.
        layout: classes, goals, and what it chooses among.
        folder: for the checkpoint after each pass, and the curve.
        progress: called after each pass.
    """
    course = BodyCourse(plan, examples, layout)
    path = folder / f"body-{plan.memory}-{plan.seed}.pt"
    checkpoint = Checkpoint(path, course.made_of)
    curve = Training(course).run(partial(progress, "body"), checkpoint)
    rows = [{"epoch": epoch, **measures} for epoch, measures in enumerate(curve, 1)]
    write_atomically(path.with_suffix(".json"), json.dumps(rows))
    return course.net


class BodyCourse(Course[EpisodeArrays]):
    """A network learns the decisions of the expert; arguments as of `train_body`.

    What a detector would have seen is drawn anew after some passes, so that its mistakes are not
    learned by heart.
    """

    net: BodyNet
    learning_rate = RATE

    def __init__(self, plan: BodyPlan, examples: Sequence[BodyExample], layout: BodyLayout) -> None:
        torch.manual_seed(plan.seed)
        self._plan = plan
        self._examples = examples
        self._layout = layout
        self._is_validation = validation_flags(
            [example.recorded.episode.task for example in examples]
        )
        self._learned: list[EpisodeArrays] = []
        self._validation: list[EpisodeArrays] = []
        self.net = make_body(layout.object_classes, layout.goals, layout.choices, plan.memory)
        self.epochs = plan.body_epochs
        self.steps_per_epoch = math.ceil(self._is_validation.count(False) / BATCH)

    @property
    def made_of(self) -> list[Any]:
        """What must be equal for a checkpoint to be used; its file's name has memory and seed."""
        object_classes, goals, choices = self._layout
        return [
            [example.recorded.episode.key for example in self._examples],
            [list(choice) for choice in choices],
            list(object_classes.names),
            [list(goals.tasks), list(goals.parts)],
            [self.epochs, VALIDATION_EVERY],
        ]

    def batches(self, epoch: int) -> Iterator[list[EpisodeArrays]]:
        """Yield the episodes to learn from, those of about equal length together."""
        if not self._learned or epoch % NEW_NOISE_EVERY == 0:
            self._draw_noise(epoch // NEW_NOISE_EVERY)
        rng = random.Random(f"{self._plan.seed}/{epoch}")
        return even_batches(self._learned, rng, lambda episode: len(episode.looks.tool), BATCH)

    def loss(self, batch: Sequence[EpisodeArrays]) -> Tensor:
        """Return `body_loss` of a batch."""
        return body_loss(self.net, to_batch(batch))

    def score(self) -> dict[str, float]:
        """Return the shares of right decisions in the validation episodes, by measure."""
        shares: dict[str, float] = score(self.net, self._validation)
        return shares

    def _draw_noise(self, times: int) -> None:
        """Turn all episodes into network input with newly drawn mistakes of the detector.

        One generator draws for all of them, in their order.

        Args:
            times: how often that was done before; it seeds the noise.
        """
        rng = np.random.default_rng((self._plan.seed, times))
        self._learned = []
        self._validation = []
        for example, is_validation in zip(self._examples, self._is_validation, strict=True):
            episode = self._network_input(example, rng)
            group = self._validation if is_validation else self._learned
            group.append(episode)

    def _network_input(self, example: BodyExample, rng: np.random.Generator) -> EpisodeArrays:
        """Return an episode as network input, with the subgoals that hands and planners need."""
        object_classes = self._layout.object_classes
        choices = self._layout.choices
        recorded = example.recorded
        goal = self._layout.goals.encode_episode(recorded.episode)
        numbers = {choice: number for number, choice in enumerate(choices)}
        episode = to_arrays(
            recorded.recording, example.decisions, goal, object_classes, numbers, rng
        )
        return with_planner_inputs(
            self._plan.memory, recorded, episode, len(choices), object_classes, rng
        )


def validation_flags(tasks: Sequence[str]) -> list[bool]:
    """Return for each episode, given its task, whether it is for validation.

    It is the second, twelfth, … episode of each task.
    """
    counts: Counter[str] = Counter()
    is_validation = []
    for task in tasks:
        is_validation.append(counts[task] % VALIDATION_EVERY == 1)
        counts[task] += 1
    return is_validation


def body_loss(body: BodyNet, batch: EpisodeBatch) -> Tensor:
    """Return the loss of a batch: `LOSS_WEIGHTS` times cross-entropies, and the error of times.

    Tracks are scored for the right move. Counts are never acted on; they teach the memory at each
    decision what to keep, as the moves do only where a count ends. A planner that chooses looks to
    keep learns these, too.
    """
    answer: BodyAnswer = body(batch)
    loss = answer.moves.new_zeros(())
    for measure, labeled in _labeled_scores(answer, batch).items():
        if len(labeled.right):
            entropy = functional.cross_entropy(labeled.scores, labeled.right)
            loss = loss + LOSS_WEIGHTS[measure] * entropy
    is_waiting = batch.steps_left >= 0
    if is_waiting.any():
        loss = loss + _time_loss(answer.time_left[is_waiting], batch.steps_left[is_waiting])
    if answer.keep_scores is not None and batch.subgoal_inputs is not None:
        loss = loss + _keep_loss(answer.keep_scores, batch.subgoal_inputs.to_keep)
    return loss


def _time_loss(found: Tensor, steps: Tensor) -> Tensor:
    """Return the loss of n times left; the less time is left, the more its error weighs.

    Args:
        found: (n,) what a network says, as of `BodyAnswer`.
        steps: (n,) the control steps that are left.
    """
    waits = 1.0 + steps / WAIT_STEPS
    errors = functional.smooth_l1_loss(found, waits.log(), reduction="none", beta=LARGE_ERROR)
    return (errors / waits).sum() / (1.0 / waits).sum()


def _keep_loss(scores: Tensor, labels: Tensor) -> Tensor:
    """Return the loss of choosing which of the recent looks to keep.

    Args:
        scores: (N, RECENT) logits.
        labels: (N, RECENT) 1 to keep, 0 not to; -1 where nothing is learned.
    """
    has_label = labels >= 0
    known_labels = labels[has_label].float()
    return functional.binary_cross_entropy_with_logits(scores[has_label], known_labels)


class LabeledScores(NamedTuple):
    """The n decisions of a batch at which a choice is learned.

    Attributes:
        scores: (n, choices) logits.
        right: (n,) numbers of the right choices.
    """

    scores: Tensor
    right: Tensor


def _labeled_scores(answer: BodyAnswer, batch: EpisodeBatch) -> dict[str, LabeledScores]:
    """Return what a network says at the decisions that have labels, by measure."""
    return {
        MOVES: _where_labeled(answer.moves, batch.moves),
        THINGS: _labeled_tracks(answer.tracks, batch),
        DONE: _where_labeled(answer.stages_done, batch.stages_done),
        PASSES: _where_labeled(answer.passes, batch.passes),
    }


def _where_labeled(scores: Tensor, labels: Tensor) -> LabeledScores:
    """Return the scores (N, choices) where labels (N,) are not -1.

    Counts beyond the greatest that is predicted are labeled as that.
    """
    has_label = labels >= 0
    most = scores.shape[-1] - 1
    return LabeledScores(scores[has_label], labels[has_label].clamp(max=most))


def _labeled_tracks(tracks: Tensor, batch: EpisodeBatch) -> LabeledScores:
    """Return the scores of tracks at those decisions whose right track can be chosen.

    Args:
        tracks: (N, M, K) logits of tracks for each move; those of the right move are taken.
        batch: with the right moves and tracks.
    """
    is_at_object = (batch.moves >= 0) & (batch.tracks >= 0)
    scores = tracks[is_at_object, batch.moves[is_at_object]]
    right = batch.tracks[is_at_object]
    # A track that is not confirmed yet is blocked, and nothing could be learned.
    is_possible = scores.gather(1, right[:, None])[:, 0] > BLOCKED_SCORE / 2
    return LabeledScores(scores[is_possible], right[is_possible])


@torch.no_grad()
def score(body: BodyNet, episodes: Sequence[EpisodeArrays]) -> dict[str, float]:
    """Return how often a network is right, from 0 to 1, by measure; 0 where nothing is labeled.

    The track is judged for the right move, whichever the network chooses.

    Args:
        body: the network.
        episodes: with the right decisions.
    """
    body.eval()
    right: Counter[str] = Counter()
    total: Counter[str] = Counter()
    for start in range(0, len(episodes), BATCH):
        batch = to_batch(episodes[start : start + BATCH])
        for measure, labeled in _labeled_scores(body(batch), batch).items():
            is_right = labeled.scores.argmax(-1) == labeled.right
            right[measure] += int(is_right.sum())
            total[measure] += len(labeled.right)
    return {measure: right[measure] / max(1, total[measure]) for measure in LOSS_WEIGHTS}
