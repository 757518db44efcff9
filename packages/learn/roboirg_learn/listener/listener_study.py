"""Train several listeners on the same scenes, and let each understand the test split."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.extension.commands import write_atomically
from roboirg.extension.episodes import (
    Episode,
    all_settings,
    episodes_of,
    goal_schema,
    plain_settings,
    spoken,
)
from roboirg_learn.labeled_views import Pixels, draw_missing, look_as_played, read_views
from roboirg_learn.listener.vocabulary import WORD_POOLS

if TYPE_CHECKING:
    from roboirg_learn.listener.learned_model import LearnedModel
    from roboirg_learn.listener.listener_training import TrainingPlan
    from roboirg_learn.trainer import Progress

WORK = "listener-work"
"""Folder next to trained listeners for pictures, detectors and readers on the way."""
HELD_OUT = "test"
"""The pool of words that no listener was trained on."""
RIVAL = "direct-rival"
"""The setting that introduces a rival."""


class StudyVariant(NamedTuple):
    """One listener of the study.

    Attributes:
        name: of its file.
        title: of its row.
        changes: of the common plan.
        hears: harder settings that it hears, too, if it hears the plain ones.
    """

    name: str
    title: str
    changes: Mapping[str, Any]
    hears: tuple[str, ...] = ()

    def plan(self, common: TrainingPlan) -> TrainingPlan:
        """Return how it is trained."""
        known, changed = all_settings(), common._replace(**self.changes)
        added = (name for name in self.hears if known[name].plain in changed.settings)
        return changed._replace(settings=(*changed.settings, *added))


VARIANTS = (
    StudyVariant("all", "all settings", {}),
    StudyVariant("explicit", "explicit only", {"settings": ("explicit",)}),
    StudyVariant("rivals", "all settings, rivals too", {}, (RIVAL,)),
    StudyVariant("no-video", "without video", {"without": "video"}),
    StudyVariant("no-pictures", "without pictures", {"without": "pictures"}),
    StudyVariant("no-words", "without words", {"without": "words"}),
)
"""Trained on all settings; on explicit words only; on rivals too; without parts of the input."""


class StudyAnswer(NamedTuple):
    """What one listener made of one instruction of the test split.

    `words` is their pool, `understood` has the slots of the goal.
    """

    listener: str
    seed: int
    task: str
    episode: int
    setting: str
    words: str
    understood: dict[str, Any]
    is_right: bool


def run_study(
    plan: TrainingPlan, folder: Path, workers: int, progress: Progress
) -> Iterator[StudyAnswer]:
    """Train every listener of the study with every seed, and yield what it understands.

    The scenes are drawn once, and all listeners of a seed have the same detector. Each listener
    becomes a file ``NAME-SEED.pt``, and its answers ``NAME-SEED.jsonl`` next to it; those that are
    there and were made of the same plan are used again.
    """
    from roboirg_learn.listener.learned_model import load_model, save_model
    from roboirg_learn.listener.listener_training import see_episodes, teach
    from roboirg_learn.listener.reader_training import check_reader
    from roboirg_learn.trainer import part_of

    check_reader(plan.tasks, plan.settings, plan.encoders, plan.language)
    work = folder / WORK
    shown: list[tuple[Episode, list[Pixels]]] = []
    for seed in range(plan.seed, plan.seed + plan.seeds):
        common, scenes = plan._replace(seed=seed), None
        for variant in VARIANTS:
            own, name = variant.plan(common), f"{variant.name}-{seed}"
            path, answers = folder / f"{name}.pt", folder / f"{name}.jsonl"
            model = load_model(path) if path.exists() else None
            if model is None or model.about != own.about:
                scenes = scenes or see_episodes(common, work, workers, progress)
                answers.unlink(missing_ok=True)
                model = teach(scenes, own, work / f"reader-{name}.pt", part_of(progress, name))
                save_model(model, path)
            if not answers.exists():
                shown = shown or _show_all(plan.tasks, work, workers, progress)
                found = _answers(model, variant.name, own, shown)
                text = "".join(json.dumps(one._asdict()) + "\n" for one in found)
                write_atomically(answers, text)
            for line in answers.read_text("utf-8").splitlines():
                yield StudyAnswer(**json.loads(line))


def _show_all(
    tasks: Sequence[str], work: Path, workers: int, progress: Progress
) -> list[tuple[Episode, list[Pixels]]]:
    """Return the episodes of the test split with the pictures that a listener looks at."""
    episodes = episodes_of(tasks, "test")
    draw_missing(work, episodes, look_as_played, workers, partial(progress, "test pictures"))
    return [
        (one, [view.picture for view in read_views(work, one, pictures=True)]) for one in episodes
    ]


def _answers(
    model: LearnedModel,
    name: str,
    plan: TrainingPlan,
    shown: Sequence[tuple[Episode, list[Pixels]]],
) -> Iterator[StudyAnswer]:
    # Every scene has many instructions, and is looked at once.
    seen = {episode.key: model.see(pictures) for episode, pictures in shown}
    episodes = [episode for episode, _ in shown]
    asked = [(setting, pool) for setting in plain_settings() for pool in WORD_POOLS]
    for setting, pool in (*asked, (RIVAL, HELD_OUT)):
        for episode, text in spoken(episodes, [setting], pool, plan.language):
            task, given = episode.task, seen[episode.key]
            goal = model.understand_seen(given._replace(task=task, text=text))
            slots = json.loads(goal_schema(task).answers[goal])
            is_right = goal == episode.goal
            yield StudyAnswer(name, plan.seed, task, episode.index, setting, pool, slots, is_right)
