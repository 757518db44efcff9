"""Train several listeners on the same scenes, and let each understand the test split.

The listeners of a study differ in what they hear or see. Words are spoken from two pools: the one
that all were trained on, and one that is held out. A rival is an object that the words could be
mistaken to mean.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
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
from roboirg_learn.labeled_views import Pixels, draw_missing, read_views, views_as_played
from roboirg_learn.listener.vocabulary import WORD_POOLS, WordPool

if TYPE_CHECKING:
    from roboirg_learn.listener.learned_model import LearnedModel, Without
    from roboirg_learn.listener.listener_training import SeenEpisodes, TrainingPlan
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.trainer import Progress

WORK = "listener-work"
"""Folder next to trained listeners for pictures, detectors and readers on the way."""
HELD_OUT: WordPool = "test"
"""The pool of words that no listener was trained on."""
RIVAL = "direct-rival"
"""The setting that introduces a rival."""


class StudyVariant(NamedTuple):
    """One listener of the study.

    Attributes:
        name: of its file.
        title: of its row.
        settings: that it hears; None for those of the common plan.
        without: what it does not get: pictures, video or words.
        hears: harder settings that it hears, too, if it hears the plain ones that they build on.
    """

    name: str
    title: str
    settings: tuple[str, ...] | None = None
    without: Without = "none"
    hears: tuple[str, ...] = ()

    def plan(self, common: TrainingPlan) -> TrainingPlan:
        """Return the plan of this listener: the common one with its own settings and inputs.

        A harder setting is added only where the plain one that it builds on is heard.

        Args:
            common: what all listeners of a seed share.
        """
        settings = self.settings or common.reader.settings
        harder = [name for name in self.hears if all_settings()[name].plain in settings]
        reader = common.reader._replace(settings=(*settings, *harder))
        return common._replace(reader=reader, without=self.without)


VARIANTS = (
    StudyVariant("all", "all settings"),
    StudyVariant("explicit", "explicit only", ("explicit",)),
    StudyVariant("rivals", "all settings, rivals too", hears=(RIVAL,)),
    StudyVariant("no-video", "without video", without="video"),
    StudyVariant("no-pictures", "without pictures", without="pictures"),
    StudyVariant("no-words", "without words", without="words"),
)
"""Trained on all settings; on explicit words only; on rivals too; without parts of the input."""


class StudyAnswer(NamedTuple):
    """What one listener made of one instruction of the test split; a line of its answer file.

    Attributes:
        listener: name of the variant.
        seed: of its training.
        task: of the episode.
        episode: its index.
        setting: in which the goal was said.
        words: pool of the words, ``train`` or ``test``.
        understood: values of the goal that it chose, by slot, such as ``{"color": "red"}``.
        is_right: whether that is the episode's goal.
    """

    listener: str
    seed: int
    task: str
    episode: int
    setting: str
    words: str
    understood: dict[str, Any]
    is_right: bool


class ShownEpisode(NamedTuple):
    """An episode with the pictures that a listener looks at."""

    episode: Episode
    pictures: list[Pixels]


def run_study(
    plan: TrainingPlan, folder: Path, workers: int, progress: Progress
) -> Iterator[StudyAnswer]:
    """Train every listener of the study with every seed, and yield what it understands.

    The scenes are drawn once, and all listeners of a seed have the same detector. Each listener
    becomes a file ``NAME-SEED.safetensors``, and its answers ``NAME-SEED.jsonl`` next to it; those
    that are there and were made of the same plan are used again.
    """
    from roboirg_learn.listener.reader_training import check_reader

    check_reader(plan.reader)
    study = _Study(folder, workers, progress)
    first_seed = plan.reader.seed
    for seed in range(first_seed, first_seed + plan.seeds):
        common = plan._replace(reader=plan.reader._replace(seed=seed))
        study.begin_seed(common)
        for variant in VARIANTS:
            own_plan = variant.plan(common)
            model = study.trained(variant, own_plan)
            yield from study.answers(variant, own_plan.reader, model)


class _Study:
    """Trains the listeners of a study, and keeps them and their answers in its folder.

    Scenes are seen and drawn when a listener first needs them, which none does if all are there.
    """

    def __init__(self, folder: Path, workers: int, progress: Progress) -> None:
        self._folder = folder
        self._work = folder / WORK
        self._workers = workers
        self._progress = progress
        self._tested: list[ShownEpisode] = []

    def begin_seed(self, common: TrainingPlan) -> None:
        """Begin the trainings with a plan's seed; call it before the other methods."""
        self._common = common
        self._scenes: SeenEpisodes | None = None

    def trained(self, variant: StudyVariant, plan: TrainingPlan) -> LearnedModel:
        """Return a trained listener: that of its file if it has the same plan, else a new one.

        A new one makes old answers wrong, so their file is removed.
        """
        from roboirg_learn.listener.learned_model import load_model, save_model
        from roboirg_learn.listener.listener_training import train_on_scenes
        from roboirg_learn.trained_file import END
        from roboirg_learn.trainer import part_of

        name = f"{variant.name}-{plan.reader.seed}"
        path = self._folder / f"{name}{END}"
        if path.exists():
            found = load_model(path)
            if found.about == plan.about:
                return found

        scenes = self._seen_scenes()
        self._answer_file(variant, plan.reader).unlink(missing_ok=True)
        checkpoint_path = self._work / f"reader-{name}.pt"
        model = train_on_scenes(scenes, plan, checkpoint_path, part_of(self._progress, name))
        save_model(model, path)
        return model

    def answers(
        self, variant: StudyVariant, plan: ReaderPlan, model: LearnedModel
    ) -> Iterator[StudyAnswer]:
        """Yield a listener's answers; if its file does not exist, ask it, and write them first."""
        path = self._answer_file(variant, plan)
        if not path.exists():
            found = _answers(model, variant.name, plan, self._test_episodes())
            lines = [json.dumps(answer._asdict()) + "\n" for answer in found]
            write_atomically(path, "".join(lines))
        for line in path.read_text("utf-8").splitlines():
            yield StudyAnswer(**json.loads(line))

    def _answer_file(self, variant: StudyVariant, plan: ReaderPlan) -> Path:
        """Return the file of a listener's answers, such as ``no-video-0.jsonl``."""
        return self._folder / f"{variant.name}-{plan.seed}.jsonl"

    def _seen_scenes(self) -> SeenEpisodes:
        """Return the scenes of training as this seed's detector sees them; cached."""
        from roboirg_learn.listener.listener_training import see_episodes

        if self._scenes is None:
            self._scenes = see_episodes(self._common, self._work, self._workers, self._progress)
        return self._scenes

    def _test_episodes(self) -> list[ShownEpisode]:
        """Return test episodes with the pictures that a listener looks at; cached."""
        if not self._tested:
            episodes = episodes_of(self._common.reader.tasks, "test")
            show = partial(self._progress, "test pictures")
            draw_missing(self._work, episodes, views_as_played, self._workers, show)
            for episode in episodes:
                views = read_views(self._work, episode, pictures=True)
                pictures = [view.picture for view in views]
                self._tested.append(ShownEpisode(episode, pictures))
        return self._tested


def _answers(
    model: LearnedModel, name: str, plan: ReaderPlan, shown: Sequence[ShownEpisode]
) -> Iterator[StudyAnswer]:
    """Yield what a listener understands of all test instructions of some episodes.

    Args:
        model: the listener.
        name: of the listener.
        plan: has its seed.
        shown: episodes with the pictures that it looks at.
    """
    # Every scene has many instructions, and is looked at once.
    seen = {scene.episode.key: model.see(scene.pictures) for scene in shown}
    episodes = [scene.episode for scene in shown]
    for setting, pool in _tested_settings():
        for episode, text in spoken(episodes, [setting], pool):
            task = episode.task
            goal = model.understand_seen(seen[episode.key]._replace(task=task, text=text))
            yield StudyAnswer(
                listener=name,
                seed=plan.seed,
                task=task,
                episode=episode.index,
                setting=setting,
                words=pool,
                understood=json.loads(goal_schema(task).answers[goal]),
                is_right=goal == episode.goal,
            )


def _tested_settings() -> Iterator[tuple[str, WordPool]]:
    """Yield each setting that is tested with each pool of words in which it is spoken.

    Plain settings are spoken in both pools, the one with a rival in held-out words only.
    """
    for setting in plain_settings():
        for pool in WORD_POOLS:
            yield setting, pool
    yield RIVAL, HELD_OUT
