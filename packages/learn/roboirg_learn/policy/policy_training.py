"""Train a policy: recordings, a detector, a body that acts, and a reader of words."""

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

from roboirg.extension.commands import InvalidValueError, parallel_map, write_atomically
from roboirg.extension.episodes import Episode, episodes_of
from roboirg.extension.sight import ExpertRecording, decode_png, points_of, record_expert
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.vocabulary import parts_of_tasks
from roboirg_learn.policy.body_training import BodyLayout, BodyLesson, train_body
from roboirg_learn.policy.moves import LookDecision, common_moves, decisions_of
from roboirg_learn.policy.policy_files import PolicyFiles
from roboirg_learn.policy.policy_plan import PLANNERS, BodyPlan, Recorded
from roboirg_learn.policy.recording_files import load_recording, save_recording
from roboirg_learn.policy.sight import Sight, sight_of, turns_of
from roboirg_learn.policy.subgoals import forms_of, subgoals_due
from roboirg_learn.policy.thing_detector import (
    LabeledPicture,
    ThingDetector,
    augmented,
    detector_loss,
)
from roboirg_learn.policy.trained_body import GoalLayout, TrainedBody, load_body, save_body
from roboirg_learn.policy.trained_reader import load_reader, save_reader
from roboirg_learn.policy.word_training import check_words, train_policy_reader
from roboirg_learn.trained_file import END
from roboirg_learn.trainer import Course, KeptTraining, Progress, Training, batches

RECORDINGS = "recordings"
"""The folder of recordings in that of a policy."""
PICTURE_EVERY = 16
"""Looks from one picture to the next in scenes that are drawn; many scenes help more than many
pictures of each."""
MOST_LOOKS = 10_000
DETECTOR_BATCH = 16
DETECTOR_RATE = 8e-3


def trained_files(
    plan: BodyPlan, words: ReaderPlan, folder: Path, workers: int, progress: Progress
) -> PolicyFiles:
    """Train the body and the reader of a policy as far as they are missing; return their files.

    The body learns from recordings of the expert, which is disturbed on purpose, in random scenes.
    What is recorded and learned stays in the folder, and is used again by the same plans, and as
    far as it fits by others: bodies with other memories, readers of other words.

    Args:
        plan: how its body learns.
        words: how its reader learns.
        folder: for recordings, for what is learned on the way, and for the files.
        workers: processes that record and draw; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.

    Raises:
        InvalidValueError: no episode of a task could be recorded, a plan cannot be followed, or
            the folder holds what another plan recorded or learned.
    """
    name = f"{words.heard}-{words.seed}"
    files = PolicyFiles(
        body=folder / f"{plan.memory}-{plan.seed}.body{END}",
        reader=folder / f"{name}.reader{END}",
    )
    check_words(words)
    _check_folder(plan, folder)
    if not files.body.exists():
        save_body(_learn_body(plan, folder, workers, progress), files.body)
    body = load_body(files.body)
    _check_plan(files.body, body.plan, plan.about)
    if not files.reader.exists():
        reader = train_policy_reader(body, words, folder, name, workers, progress)
        save_reader(reader, files.reader)
    _check_plan(files.reader, load_reader(files.reader).plan, words.about)
    return files


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


def _learn_body(plan: BodyPlan, folder: Path, workers: int, progress: Progress) -> TrainedBody:
    """Return a trained body; with a planner if the memory of the plan is one.

    A planner is a second network like the body's, which learns subgoals instead of waypoints.
    """
    recorded = record_all(plan, folder, workers, progress)
    body = _body_alone(plan, recorded, folder, progress)
    if plan.memory not in PLANNERS:
        return body
    forms = forms_of(played.episode for played in recorded)
    lessons = [BodyLesson(played, _subgoals_of(played)) for played in recorded]
    layout = BodyLayout(body.sight, body.goals, forms)
    planner = train_body(plan, lessons, layout, folder, progress)
    return replace(body, forms=forms, planner=planner)


def _body_alone(
    plan: BodyPlan, recorded: Sequence[Recorded], folder: Path, progress: Progress
) -> TrainedBody:
    """Return a trained body without planner: its detector, and the network that moves.

    Where the plan has a planner, that network learns to follow subgoals instead of a goal.
    """
    sight = sight_of(played.recording for played in recorded)
    goals = GoalLayout(plan.tasks, parts_of_tasks(plan.tasks))
    lessons = [BodyLesson(played, decisions_of(played.recording)) for played in recorded]
    moves = common_moves(lesson.decisions for lesson in lessons)
    detector = _trained_detector(plan, recorded, sight, folder, progress)
    net = train_body(plan.of_net, lessons, BodyLayout(sight, goals, moves), folder, progress)
    about = {**plan.about, "episodes": len(recorded)}
    return TrainedBody(sight, detector, goals, moves, net, about)


def _subgoals_of(played: Recorded) -> list[LookDecision]:
    """Return the subgoal that is due at each decision of a recorded episode."""
    looks = [decision.look for decision in decisions_of(played.recording)]
    return subgoals_due(played.recording, played.episode, looks)


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
    _record_missing(episodes, plan.drawn, recordings, workers, progress)
    found = []
    for episode in episodes:
        recording = load_recording(_path(recordings, episode))
        if recording.status == "success":
            found.append(Recorded(episode, recording))

    learned_tasks = {played.episode.task for played in found}
    for task in plan.tasks:
        if task not in learned_tasks:
            raise InvalidValueError(
                f"The expert succeeded in none of {plan.scenes} scenes of {task}; record more."
            )
    return found


def _record_missing(
    episodes: Sequence[Episode], drawn: int, folder: Path, workers: int, progress: Progress
) -> None:
    """Record the episodes that the folder does not have, in worker processes.

    Args:
        episodes: all of them.
        drawn: of how many scenes of each task pictures are drawn.
        folder: of the recordings.
        workers: processes; 0 uses this one.
        progress: called after each recording.
    """
    missing = [episode for episode in episodes if not _path(folder, episode).exists()]
    done = len(episodes) - len(missing)
    for _ in parallel_map(partial(_record, folder, drawn), missing, workers):
        done += 1
        progress("recordings", done, len(episodes))


def _path(folder: Path, episode: Episode) -> Path:
    return folder / f"{episode.task}-{episode.index:05d}.npz"


def _record(folder: Path, drawn: int, episode: Episode) -> None:
    """Record the expert in an episode, and write the recording; runs in worker processes.

    In the first `drawn` episodes of a task every `PICTURE_EVERY`-th look also has a picture.
    """
    pictures = range(0)
    if episode.index < drawn:
        # Not the same looks in every scene.
        pictures = range(episode.index % PICTURE_EVERY, MOST_LOOKS, PICTURE_EVERY)
    save_recording(record_expert(episode, pictures), _path(folder, episode))


def _trained_detector(
    plan: BodyPlan, recorded: Sequence[Recorded], sight: Sight, folder: Path, progress: Progress
) -> ThingDetector:
    """Return a trained detector; a finished or interrupted training of the folder goes on."""
    course = ThingDetectorCourse(plan, recorded, sight)
    kept = KeptTraining(folder / "detector.pt", course.made_of)
    Training(course).run(partial(progress, "detector"), kept)
    return course.net


class ThingDetectorCourse(Course[LabeledPicture]):
    """A detector learns the pictures of recordings, which are moved and mirrored in each pass."""

    net: ThingDetector
    rate = DETECTOR_RATE

    def __init__(self, plan: BodyPlan, recorded: Sequence[Recorded], sight: Sight) -> None:
        torch.manual_seed(plan.seed)
        self._plan = plan
        self._recorded = recorded
        self._sight = sight
        self._views: list[LabeledPicture] = []
        self._count = sum(len(played.recording.pictures) for played in recorded)
        self.net = ThingDetector(len(sight.classes))
        self.epochs = plan.detector_epochs
        self.steps = math.ceil(self._count / DETECTOR_BATCH)

    @property
    def made_of(self) -> list[Any]:
        """What must be equal for a kept training to go on: all but the seed."""
        return [list(self._sight.classes), list(self._plan.tasks), self._count, self.epochs]

    def batches(self, epoch: int) -> Iterator[list[LabeledPicture]]:
        """Yield all pictures in random batches, moved and mirrored anew in each pass."""
        self._decode()
        variation = np.random.default_rng((self._plan.seed, epoch))
        rng = random.Random(f"{self._plan.seed}/{epoch}")
        for batch in batches(self._views, rng, DETECTOR_BATCH):
            yield [augmented(view, variation) for view in batch]

    def loss(self, batch: Sequence[LabeledPicture]) -> torch.Tensor:
        return detector_loss(self.net, batch)

    def _decode(self) -> None:
        """Decode all pictures once, which a training that has ended before does not need."""
        if not self._views:
            for played in self._recorded:
                self._views += labeled_pictures(played.recording, self._sight)


def labeled_pictures(recorded: ExpertRecording, sight: Sight) -> Iterator[LabeledPicture]:
    """Yield the pictures of an episode, each with the things that the simulator shows in it."""
    kinds = sight.kinds(recorded.classes)
    for look, png in recorded.pictures.items():
        is_shown = recorded.visible[look] & (kinds >= 0)
        things = recorded.things[look, is_shown].astype(np.float64)
        points = points_of(things[:, :3])
        turns = turns_of(things[:, 3])
        yield LabeledPicture(decode_png(png), kinds[is_shown], points, turns)
