"""Train a policy: recordings, a detector, a body that acts, and a reader of words.

A body sees, remembers and moves for a goal that it is given; a reader names the goal that words
mean. They are trained apart, and become two files.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from roboirg.extension.commands import InvalidValueError, write_atomically
from roboirg.extension.episodes import Episode, episodes_of
from roboirg.extension.sight import ExpertRecording, decode_png, points_of, record_expert
from roboirg_learn.learn_support import make_missing_files
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.vocabulary import parts_of_tasks
from roboirg_learn.policy.body_training import BodyExample, BodyLayout, train_body
from roboirg_learn.policy.moves import common_moves, decisions_of
from roboirg_learn.policy.object_detector import (
    LabeledPicture,
    ObjectDetector,
    augmented,
    detector_loss,
)
from roboirg_learn.policy.policy_files import PolicyFiles
from roboirg_learn.policy.policy_plan import PLANNERS, BodyPlan, Recorded
from roboirg_learn.policy.recording_files import load_recording, save_recording
from roboirg_learn.policy.sight import (
    UNKNOWN_CLASS,
    ObjectClasses,
    encode_yaws,
    object_classes_of,
)
from roboirg_learn.policy.subgoals import subgoals_due, templates_of
from roboirg_learn.policy.trained_body import GoalLayout, TrainedBody, load_body, save_body
from roboirg_learn.policy.trained_reader import load_reader, save_reader
from roboirg_learn.policy.word_training import check_words, train_policy_reader
from roboirg_learn.trained_file import END
from roboirg_learn.trainer import Checkpoint, Course, Progress, Training, batches

RECORDINGS = "recordings"
"""The folder of recordings in that of a policy."""
PICTURE_EVERY = 16
"""Looks from one picture to the next in scenes whose pictures are rendered; many scenes help more
than many pictures of each."""
MOST_LOOKS = 10_000
"""More than any episode has."""
DETECTOR_BATCH = 16
DETECTOR_RATE = 8e-3


def trained_files(
    plan: BodyPlan, reader_plan: ReaderPlan, folder: Path, workers: int, progress: Progress
) -> PolicyFiles:
    """Train the body and the reader of a policy as far as they are missing; return their files.

    The body learns from recordings of the expert, which is disturbed on purpose, in random scenes.
    What is recorded and learned stays in the folder, and is used again by the same plans, and as
    far as it fits by others: bodies with other memories, readers of other words.

    Args:
        plan: how its body learns.
        reader_plan: how its reader learns.
        folder: for recordings, for what is learned on the way, and for the files.
        workers: processes that record and render; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.

    Raises:
        InvalidValueError: no episode of a task could be recorded, a plan cannot be followed, or
            the folder holds what another plan recorded or learned.
    """
    check_words(reader_plan)
    body = trained_body_file(plan, folder, workers, progress)
    reader = trained_reader_file(body, reader_plan, folder, workers, progress)
    return PolicyFiles(body, reader)


def prepare_bodies(plan: BodyPlan, folder: Path, workers: int, progress: Progress) -> None:
    """Make what all bodies of a folder share, unless it has them: recordings and a detector.

    Afterwards several bodies can be trained at once. Arguments and errors are those of
    `trained_files`.
    """
    _check_folder(plan, folder)
    recorded = record_all(plan, folder, workers, progress)
    object_classes = object_classes_of(played.recording for played in recorded)
    _trained_detector(plan, recorded, object_classes, folder, progress)


def trained_body_file(plan: BodyPlan, folder: Path, workers: int, progress: Progress) -> Path:
    """Train the body of a policy unless the folder has it; return its file.

    Arguments and errors are those of `trained_files`.
    """
    _check_folder(plan, folder)
    path = folder / f"{plan.memory}-{plan.seed}.body{END}"
    if not path.exists():
        save_body(_trained_body(plan, folder, workers, progress), path)
    _check_plan(path, load_body(path).plan, plan.about)
    return path


def trained_reader_file(
    body: Path, plan: ReaderPlan, folder: Path, workers: int, progress: Progress
) -> Path:
    """Train a reader of words for a body unless the folder has it; return the reader's file.

    Args:
        body: file of the body, whose detector sees the scenes.
        plan: how the reader learns.
        folder: for checkpoints and for the file.
        workers: processes that render; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.

    Raises:
        InvalidValueError: the folder has the reader of another plan.
    """
    name = f"{plan.heard}-{plan.seed}"
    path = folder / f"{name}.reader{END}"
    if not path.exists():
        reader = train_policy_reader(load_body(body), plan, folder, name, workers, progress)
        save_reader(reader, path)
    _check_plan(path, load_reader(path).plan, plan.about)
    return path


def _check_plan(path: Path, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    """Refuse a file that was trained by another plan.

    Args:
        path: of the file.
        found: the plan that the file has; it may have more fields than are wanted.
        wanted: the plan that it should have.
    """
    if not wanted.items() <= found.items():
        raise InvalidValueError(
            f"{str(path)!r} was trained by another plan; give another folder, or delete it."
        )


def _trained_body(plan: BodyPlan, folder: Path, workers: int, progress: Progress) -> TrainedBody:
    """Return a trained body; with a planner if the memory of the plan is one.

    A planner is a second network like the body's, which learns subgoals instead of waypoints.
    """
    recorded = record_all(plan, folder, workers, progress)
    body = _body_without_planner(plan, recorded, folder, progress)
    if plan.memory not in PLANNERS:
        return body
    templates = templates_of(played.episode for played in recorded)
    examples = []
    for played in recorded:
        looks = [decision.look for decision in decisions_of(played.recording)]
        due = subgoals_due(played.recording, played.episode, looks)
        examples.append(BodyExample(played, due))
    layout = BodyLayout(body.object_classes, body.goals, templates)
    planner = train_body(plan, examples, layout, folder, progress)
    return replace(body, templates=templates, planner=planner)


def _body_without_planner(
    plan: BodyPlan, recorded: Sequence[Recorded], folder: Path, progress: Progress
) -> TrainedBody:
    """Train a detector, and the network that chooses waypoints; return both as a body.

    Where the plan has a planner, that network becomes its hands: it learns to follow subgoals
    instead of a goal.

    Args:
        plan: tasks, memory, seed and passes.
        recorded: the episodes to learn from.
        folder: for checkpoints and the learning curve.
        progress: called after each pass.
    """
    object_classes = object_classes_of(played.recording for played in recorded)
    detector = _trained_detector(plan, recorded, object_classes, folder, progress)

    goals = GoalLayout(plan.tasks, parts_of_tasks(plan.tasks))
    examples = [BodyExample(played, decisions_of(played.recording)) for played in recorded]
    moves = common_moves(example.decisions for example in examples)
    layout = BodyLayout(object_classes, goals, moves)
    net = train_body(plan.of_net, examples, layout, folder, progress)

    about = {**plan.about, "episodes": len(recorded)}
    return TrainedBody(object_classes, detector, goals, moves, net, about)


def _check_folder(plan: BodyPlan, folder: Path) -> None:
    """Refuse a folder whose recordings were made for another plan.

    ``recorded.json`` in the folder has what they depend on; it is written if there is none.
    """
    path = folder / "recorded.json"
    if (folder / RECORDINGS).exists() and not path.exists():
        raise InvalidValueError(
            f"{str(folder)!r} holds recordings of an earlier version; give another folder."
        )
    about = plan.about
    wanted = {name: about[name] for name in ("tasks", "drawn", "environment_version")}
    if not path.exists():
        write_atomically(path, json.dumps(wanted))
    found = json.loads(path.read_text(encoding="utf-8"))
    for name, value in wanted.items():
        if found.get(name) != value:
            raise InvalidValueError(
                f"{str(folder)!r} holds recordings with {name} {found.get(name)}, not {value}; "
                "give another folder."
            )


def record_all(plan: BodyPlan, folder: Path, workers: int, progress: Progress) -> list[Recorded]:
    """Record the expert in the plan's scenes, and return the episodes in which it succeeded.

    Recordings that the folder has are not made again.

    Raises:
        InvalidValueError: it succeeded in none of a task.
    """
    recordings = folder / RECORDINGS
    recordings.mkdir(parents=True, exist_ok=True)
    # All tasks by turns, so that an interrupted recording has some of each.
    every_scene = episodes_of(plan.tasks, "random", plan.scenes)
    episodes = sorted(every_scene, key=lambda episode: episode.index)
    path_of = partial(_recording_path, recordings)
    record = partial(_record, recordings, plan.drawn)
    make_missing_files(episodes, path_of, record, workers, partial(progress, "recordings"))

    succeeded = []
    for episode in episodes:
        recording = load_recording(path_of(episode))
        if recording.status == "success":
            succeeded.append(Recorded(episode, recording))
    learned_tasks = {played.episode.task for played in succeeded}
    for task in plan.tasks:
        if task not in learned_tasks:
            raise InvalidValueError(
                f"The expert succeeded in none of {plan.scenes} scenes of {task}; record more."
            )
    return succeeded


def _recording_path(folder: Path, episode: Episode) -> Path:
    """Return the file of an episode's recording, such as ``PickXtimes-00012.npz``."""
    return folder / f"{episode.task}-{episode.index:05d}.npz"


def _record(folder: Path, drawn: int, episode: Episode) -> None:
    """Record the expert in an episode, and write the recording; runs in worker processes.

    Args:
        folder: of the recordings.
        drawn: of so many episodes of each task, the first, every `PICTURE_EVERY`-th look also has
            a picture.
        episode: to record.
    """
    looks_with_picture = range(0)
    if episode.index < drawn:
        # Not the same looks in every scene.
        looks_with_picture = range(episode.index % PICTURE_EVERY, MOST_LOOKS, PICTURE_EVERY)
    save_recording(record_expert(episode, looks_with_picture), _recording_path(folder, episode))


def _trained_detector(
    plan: BodyPlan,
    recorded: Sequence[Recorded],
    object_classes: ObjectClasses,
    folder: Path,
    progress: Progress,
) -> ObjectDetector:
    """Return a trained detector; a finished or interrupted training of the folder goes on."""
    course = ObjectDetectorCourse(plan, recorded, object_classes)
    checkpoint = Checkpoint(folder / "detector.pt", course.made_of)
    Training(course).run(partial(progress, "detector"), checkpoint)
    return course.net


class ObjectDetectorCourse(Course[LabeledPicture]):
    """A detector learns the pictures of recordings, shifted and mirrored anew in each pass."""

    net: ObjectDetector
    learning_rate = DETECTOR_RATE

    def __init__(
        self, plan: BodyPlan, recorded: Sequence[Recorded], object_classes: ObjectClasses
    ) -> None:
        torch.manual_seed(plan.seed)
        self._plan = plan
        self._recorded = recorded
        self._object_classes = object_classes
        self._views: list[LabeledPicture] = []
        self._count = sum(len(played.recording.pictures) for played in recorded)
        self.net = ObjectDetector(len(object_classes.names))
        self.epochs = plan.detector_epochs
        self.steps_per_epoch = math.ceil(self._count / DETECTOR_BATCH)

    @property
    def made_of(self) -> list[Any]:
        """What must be equal for a checkpoint to be used: all but the seed."""
        names = list(self._object_classes.names)
        return [names, list(self._plan.tasks), self._count, self.epochs]

    def batches(self, epoch: int) -> Iterator[list[LabeledPicture]]:
        """Yield all pictures in random batches, shifted and mirrored anew in each pass."""
        self._decode_once()
        variation = np.random.default_rng((self._plan.seed, epoch))
        rng = random.Random(f"{self._plan.seed}/{epoch}")
        for batch in batches(self._views, rng, DETECTOR_BATCH):
            yield [augmented(view, variation) for view in batch]

    def loss(self, batch: Sequence[LabeledPicture]) -> torch.Tensor:
        """Return `detector_loss` of a batch."""
        return detector_loss(self.net, batch)

    def _decode_once(self) -> None:
        """Decode all pictures at the first pass; a training that has ended before needs none."""
        if not self._views:
            for played in self._recorded:
                self._views += labeled_pictures(played.recording, self._object_classes)


def labeled_pictures(
    recorded: ExpertRecording, object_classes: ObjectClasses
) -> Iterator[LabeledPicture]:
    """Yield the pictures of an episode, each with the objects that the simulator shows in it.

    Objects of classes that are not in `object_classes` are left out.
    """
    classes = object_classes.class_numbers(recorded.classes)
    for look, png in recorded.pictures.items():
        is_shown = recorded.visible[look] & (classes != UNKNOWN_CLASS)
        poses = recorded.things[look, is_shown].astype(np.float64)  # x, y, z, yaw
        points = points_of(poses[:, :3])
        yaw_codes = encode_yaws(poses[:, 3])
        yield LabeledPicture(decode_png(png), classes[is_shown], points, yaw_codes)
