"""Train a policy: recordings, a detector, a body that acts, and a reader of words."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from roboirg.extension.commands import (
    InvalidValueError,
    parallel_map,
    short_hash,
    write_atomically,
)
from roboirg.extension.episodes import (
    ENVIRONMENT_VERSION,
    Episode,
    episodes_of,
    language_label,
)
from roboirg.extension.sight import ExpertRecording, decode_png, points_of, record_expert
from roboirg_learn.listener.encoders import ENCODERS
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.object_relations import corners_of
from roboirg_learn.listener.reader_training import (
    Lesson,
    check_reader,
    lesson_of,
    said,
    train_reader,
)
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, make_vocabulary
from roboirg_learn.policy.body_training import train_body
from roboirg_learn.policy.moves import common_moves, decisions_of
from roboirg_learn.policy.policy_model import (
    FIRST_LOOKS,
    PolicyModel,
    load_policy,
    save_policy,
    seen_things,
)
from roboirg_learn.policy.policy_plan import (
    HANDS,
    PLANNERS,
    WORDLESS,
    PolicyPlan,
    Recorded,
)
from roboirg_learn.policy.recording_files import load_recording, save_recording
from roboirg_learn.policy.sight import (
    Sight,
    labeled_looks,
    sight_of,
    turns_of,
)
from roboirg_learn.policy.subgoals import forms_of, subgoals_due
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.thing_detector import (
    LabeledPicture,
    ThingDetector,
    detector_loss,
    varied,
)
from roboirg_learn.policy.tracks import LookTokens
from roboirg_learn.trainer import KeptTraining, Progress, Trainer, batch_count, batches

RECORDINGS = "recordings"
"""The folder of recordings in that of a policy."""
PICTURE_EVERY = 16
"""Looks from one picture to the next in scenes that are drawn; many scenes help more than many
pictures of each."""
MOST_LOOKS = 10_000
DETECTOR_BATCH, DETECTOR_RATE = 16, 8e-3
TASK_EPOCHS, TASK_RATE = 6, 5e-3
FORGOTTEN_WORDS = 0.1
"""Share of the words that the task must be named without."""


def train_policy(plan: PolicyPlan, folder: Path, workers: int, progress: Progress) -> PolicyModel:
    """Return a policy that has learned from the disturbed expert in random scenes.

    What is recorded and learned stays in the folder, and is used again by the same plan, and as
    far as it fits by others.

    Args:
        plan: how.
        folder: for recordings, and for what is learned on the way.
        workers: processes that record; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.

    Raises:
        InvalidValueError: no episode of a task could be recorded, the plan cannot be followed, or
            the folder holds what another plan recorded.
    """
    check_reader(plan.tasks, plan.settings, plan.encoders, plan.language)
    if pixels := [name for name in plan.encoders if ENCODERS[name].reads_pixels]:
        raise InvalidValueError(f"Encoder {pixels[0]!r} reads pixels; a policy's reader has none.")
    _check_folder(plan, folder)
    recorded = record_all(plan, folder, workers, progress)
    sight = sight_of(one.recording for one in recorded)
    detector = _detector(plan, recorded, sight, folder, progress)
    corners = _corners(recorded)
    lessons, vocabulary = _lessons(plan, recorded, sight, corners)
    decisions = [decisions_of(one.recording) for one in recorded]
    moves = common_moves(decisions)
    planned = plan.memory in PLANNERS
    hands = plan._replace(memory=HANDS) if planned else plan
    body = train_body(hands, recorded, decisions, moves, sight, vocabulary, folder, progress)
    forms = forms_of(one.episode for one in recorded) if planned else ()
    planner = None
    if planned:
        due = [
            subgoals_due(one.recording, one.episode, [decision.look for decision in own])
            for one, own in zip(recorded, decisions, strict=True)
        ]
        planner = train_body(plan, recorded, due, forms, sight, vocabulary, folder, progress)
    task_net, reader = _train_words(plan, lessons, vocabulary, folder, progress)
    about = {**about_policy(plan), "episodes": len(recorded)}
    return PolicyModel(
        sight, detector, vocabulary, task_net, reader, corners, moves, plan.memory,
        body, about, forms, planner,
    )  # fmt: skip


def trained_file(plan: PolicyPlan, folder: Path, workers: int, progress: Progress) -> Path:
    """Return the file of a policy; it is trained unless the folder has it.

    Raises:
        InvalidValueError: as for `train_policy`, or the file is of another plan.
    """
    path = folder / f"{plan.name}.pt"
    if not path.exists():
        save_policy(train_policy(plan, folder, workers, progress), path)
    about = load_policy(path).about
    if any(about.get(name) != value for name, value in about_policy(plan).items()):
        raise InvalidValueError(
            f"{str(path)!r} was trained by another plan; give another folder, or delete it."
        )
    return path


def about_policy(plan: PolicyPlan) -> dict[str, Any]:
    """Return what a policy's file says about its plan."""
    return {
        **{name: value for name, value in plan._asdict().items() if name != "language"},
        "tasks": list(plan.tasks),
        "settings": list(plan.settings),
        "words": plan.words if plan.settings else WORDLESS,
        "language_version": language_label(plan.tasks, plan.words, plan.language, plan.settings),
    }


def _check_folder(plan: PolicyPlan, folder: Path) -> None:
    """Refuse a folder whose recordings and detector do not fit; write what they are made for."""
    path, recordings = folder / "recorded.json", folder / RECORDINGS
    if recordings.exists() and not path.exists():
        raise InvalidValueError(
            f"{str(folder)!r} holds recordings of an earlier version; give another folder."
        )
    wanted = {
        "tasks": list(plan.tasks),
        "drawn": plan.drawn,
        "environment_version": ENVIRONMENT_VERSION,
    }
    if not path.exists():
        write_atomically(path, json.dumps(wanted))
    found = json.loads(path.read_text(encoding="utf-8"))
    for name, value in wanted.items():
        if found.get(name) != value:
            raise InvalidValueError(
                f"{str(folder)!r} holds recordings with {name} {found.get(name)}, not {value}; "
                "give another folder."
            )


def record_all(plan: PolicyPlan, folder: Path, workers: int, progress: Progress) -> list[Recorded]:
    """Record what is missing, and return the episodes in which the expert succeeded.

    Raises:
        InvalidValueError: it succeeded in none of a task.
    """
    place = folder / RECORDINGS
    place.mkdir(parents=True, exist_ok=True)
    episodes = sorted(episodes_of(plan.tasks, "random", plan.scenes), key=lambda one: one.index)
    missing = [one for one in episodes if not _path(place, one).exists()]
    record = partial(_record, place, plan.drawn)
    for done, _ in enumerate(parallel_map(record, missing, workers), 1):
        progress("recordings", len(episodes) - len(missing) + done, len(episodes))
    recorded = [Recorded(one, load_recording(_path(place, one))) for one in episodes]
    found = [one for one in recorded if one.recording.status == "success"]
    for task in plan.tasks:
        if not any(one.episode.task == task for one in found):
            raise InvalidValueError(
                f"The expert succeeded in none of {plan.scenes} scenes of {task}; record more."
            )
    return found


def _path(folder: Path, episode: Episode) -> Path:
    return folder / f"{episode.task}-{episode.index:05d}.npz"


def _record(folder: Path, drawn: int, episode: Episode) -> None:
    first, end = episode.index % PICTURE_EVERY, MOST_LOOKS if episode.index < drawn else 0
    recorded = record_expert(episode, range(first, end, PICTURE_EVERY))
    save_recording(recorded, _path(folder, episode))


def _detector(
    plan: PolicyPlan, recorded: Sequence[Recorded], sight: Sight, folder: Path, progress: Progress
) -> ThingDetector:
    """Return the folder's detector if it is of the same plan, or train it."""
    torch.manual_seed(plan.seed)
    detector = ThingDetector(len(sight.classes))
    views: list[LabeledPicture] = []
    count = sum(len(one.recording.pictures) for one in recorded)
    made_of = [list(sight.classes), list(plan.tasks), count, plan.detector_epochs]

    def moved(number: int) -> Iterator[list[LabeledPicture]]:
        if not views:
            views.extend(
                view for one in recorded for view in labeled_pictures(one.recording, sight)
            )
        variation = np.random.default_rng((plan.seed, number))
        rng = random.Random(f"{plan.seed}/{number}")
        for batch in batches(views, rng, DETECTOR_BATCH):
            yield [varied(one, variation) for one in batch]

    trainer = Trainer[LabeledPicture](
        detector,
        lambda batch: detector_loss(detector, batch),
        DETECTOR_RATE,
        plan.detector_epochs * math.ceil(count / DETECTOR_BATCH),
    )
    kept = KeptTraining(folder / "detector.pt", made_of)
    trainer.learn(plan.detector_epochs, moved, partial(progress, "detector"), kept)
    return detector


def labeled_pictures(recorded: ExpertRecording, sight: Sight) -> Iterator[LabeledPicture]:
    """Yield the pictures of an episode with what the simulator says is in them."""
    kinds = sight.kinds(recorded.classes)
    for look, png in recorded.pictures.items():
        shown = recorded.visible[look] & (kinds >= 0)
        things = recorded.things[look, shown].astype(np.float64)
        points, turns = points_of(things[:, :3]), turns_of(things[:, 3])
        yield LabeledPicture(decode_png(png), kinds[shown], points, turns)


def _corners(recorded: Sequence[Recorded]) -> NDArray[np.float64]:
    """Return the corners of the area where things stand at first, as `corners_of` does."""
    first = [one.recording.things[0, one.recording.visible[0], :2] for one in recorded]
    return corners_of(np.concatenate(first))


def _lessons(
    plan: PolicyPlan, recorded: Sequence[Recorded], sight: Sight, corners: NDArray[np.float64]
) -> tuple[list[Lesson], Vocabulary]:
    """Return the instructions that the reader hears, and what it can name."""
    rng = np.random.default_rng(plan.seed)
    seen = {
        one.episode.key: seen_things(first_looks(one.recording, sight, rng), corners, sight.classes)
        for one in recorded
    }
    episodes = [one.episode for one in recorded]
    told = list(said(episodes, plan.settings, plan.words, plan.goals, plan.seed, plan.language))
    if not plan.settings:
        told = [(episode, "") for episode in episodes]
    vocabulary = make_vocabulary((text for _, text in told), sight.classes, plan.tasks)
    lessons = [
        lesson_of(ListenerInput(episode.task, text, seen[episode.key]), episode)
        for episode, text in told
    ]
    return lessons, vocabulary


def first_looks(
    recorded: ExpertRecording, sight: Sight, rng: np.random.Generator
) -> list[LookTokens]:
    """Return what the reader of words sees of an episode."""
    wanted = FIRST_LOOKS if recorded.is_video[0] else FIRST_LOOKS[:1]
    looks = enumerate(labeled_looks(recorded, sight, rng))
    return [tokens for look, (tokens, _) in looks if look in wanted]


def _train_words(
    plan: PolicyPlan,
    lessons: Sequence[Lesson],
    vocabulary: Vocabulary,
    folder: Path,
    progress: Progress,
) -> tuple[TaskNet, ListenerNet]:
    """Return what names the task, and what reads the goal: the folder's, or train them."""
    texts = short_hash("\n".join(one.given.text for one in lessons))
    made_of = [*map(list, vocabulary), texts, plan.reader_epochs, dict(plan.encoders)]
    name = f"{plan.heard}-{plan.seed}.pt"
    torch.manual_seed(plan.seed)
    kept = KeptTraining(folder / f"tasks-{name}", made_of)
    task_net = _train_tasks(plan, lessons, vocabulary, kept, progress)
    reader = train_reader(
        lessons, vocabulary, plan.reader_epochs, plan.seed, progress, plan.encoders,
        KeptTraining(folder / f"words-{name}", made_of),
    )  # fmt: skip
    return task_net, reader


def _train_tasks(
    plan: PolicyPlan,
    lessons: Sequence[Lesson],
    vocabulary: Vocabulary,
    kept: KeptTraining,
    progress: Progress,
) -> TaskNet:
    """Return what names the task."""
    rng = random.Random(plan.seed)
    task_net = TaskNet(vocabulary)
    numbers = {task: number for number, task in enumerate(plan.tasks)}

    def task_loss(batch: Sequence[Lesson]) -> torch.Tensor:
        texts = [_thinned(one.given.text, rng) for one in batch]
        wanted = torch.tensor([numbers[one.given.task] for one in batch])
        scores = task_net(texts, [one.given.seen for one in batch])
        return functional.cross_entropy(scores, wanted)

    trainer = Trainer[Lesson](task_net, task_loss, TASK_RATE, TASK_EPOCHS * batch_count(lessons))

    def mixed(number: int) -> Iterator[list[Lesson]]:
        rng.seed(f"{plan.seed}/{number}")
        return batches(lessons, rng)

    trainer.learn(TASK_EPOCHS, mixed, partial(progress, "tasks"), kept)
    return task_net


def _thinned(text: str, rng: random.Random) -> str:
    """Return a text without some of its words."""
    return " ".join(word for word in text.split() if rng.random() >= FORGOTTEN_WORDS)
