"""Train several listeners on the same scenes, and let each understand the test split."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from roboirg.apps.learning.labeled_views import LATER_STEP
from roboirg.core.episode import Episode, Split
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import FRONT
from roboirg.core.word_pools import POOLS, PoolName
from roboirg.envs.environment import RoboIRGEnv
from roboirg.language import FORMS
from roboirg.language.rivals import RIVAL_SETTINGS
from roboirg.language.settings import all_settings, plain_settings
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import SIZES, get_episode
from roboirg.util.parallel_map import parallel_map

if TYPE_CHECKING:
    from roboirg.apps.learning.listener.learned_model import LearnedModel, Pixels
    from roboirg.apps.learning.listener.listener_training import TrainingPlan
    from roboirg.apps.learning.trainer import Progress

TEST: Split = "test"
HELD_OUT: PoolName = "test"


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
    StudyVariant("rivals", "all settings, rivals too", {}, RIVAL_SETTINGS),
    StudyVariant("no-video", "without video", {"without": "video"}),
    StudyVariant("no-pictures", "without pictures", {"without": "pictures"}),
    StudyVariant("no-words", "without words", {"without": "words"}),
)
"""Trained on all settings; on explicit words only; on rivals too; without parts of the input."""


class StudyAnswer(NamedTuple):
    """What one listener made of one instruction of the test split.

    Attributes:
        listener: title of the variant.
        task: of the episode.
        episode: its place in the split.
        options: of the instruction; `wordings` is the pool of words.
        is_right: whether it understood the goal.
    """

    listener: str
    task: str
    episode: int
    options: InstructionOptions
    is_right: bool


def run_study(
    plan: TrainingPlan, folder: Path, workers: int, progress: Progress
) -> Iterator[StudyAnswer]:
    """Train every listener of the study, write its file, and yield what it understands.

    The scenes are drawn once, and all listeners have the same detector.

    Args:
        plan: of the first listener; the others differ as `VARIANTS` says.
        folder: for the files, ``NAME.pt``.
        workers: processes that draw pictures; 0 uses this one.
        progress: called with a kind of work, what is done of it, and all of it.
    """
    from roboirg.apps.learning.listener.learned_model import save_model
    from roboirg.apps.learning.listener.listener_training import see_episodes, teach

    scenes = see_episodes(plan, workers, progress)
    shown = list(_show_all(plan.tasks, workers, progress))
    for variant in VARIANTS:

        def follow(work: str, done: int, total: int, name: str = variant.name) -> None:
            progress(f"{name}: {work}", done, total)

        model = teach(scenes, variant.plan(plan), follow)
        save_model(model, folder / f"{variant.name}.pt")
        yield from _answers(model, variant.title, shown)


def _show_all(
    tasks: Sequence[str], workers: int, progress: Progress
) -> Iterator[tuple[Episode, Sequence[Pixels]]]:
    """Yield the episodes of the test split with the pictures that a listener looks at."""
    episodes = [get_episode(task, TEST, place) for task in tasks for place in range(SIZES[TEST])]
    found = {}
    for episode, pictures in parallel_map(pictures_of, episodes, workers):
        found[episode.key] = pictures
        progress("test pictures", len(found), len(episodes))
    yield from ((episode, found[episode.key]) for episode in episodes)


def pictures_of(episode: Episode) -> list[Pixels]:
    """Return the pictures that a learned listener looks at when it plays an episode."""
    from roboirg.apps.learning.listener.learned_model import pictures_to_see

    # Only the first frame and the one at that step are looked at.
    env = RoboIRGEnv(episode, cameras=(FRONT,), demonstration_frames=LATER_STEP)
    try:
        observation, info = env.reset()
        video = info["demonstration"]
        frames = video["front_rgb"] if video.length else ()
        return pictures_to_see(observation["front_rgb"], frames, LATER_STEP)
    finally:
        env.close()


def _answers(
    model: LearnedModel, title: str, shown: Sequence[tuple[Episode, Sequence[Pixels]]]
) -> Iterator[StudyAnswer]:
    understand = _reader_of(model, shown)
    episodes = [episode for episode, _ in shown]
    for options in told_options():
        told = instructions(episodes, (options.setting,), FORMS[:1], options)
        for episode, instruction in told:
            is_right = understand(episode, instruction.text)
            yield StudyAnswer(title, episode.task, episode.index, options, is_right)


def told_options() -> Iterator[InstructionOptions]:
    """Yield the words of the test split: in words of both pools, and with rivals."""
    for setting in plain_settings():
        for pool in POOLS:
            yield InstructionOptions(setting, wordings=pool)
    for setting in RIVAL_SETTINGS:
        yield InstructionOptions(setting, wordings=HELD_OUT)


def _reader_of(
    model: LearnedModel, shown: Sequence[tuple[Episode, Sequence[Pixels]]]
) -> Callable[[Episode, str], bool]:
    # Every scene has many instructions, and is looked at once.
    seen = {episode.key: model.see(pictures) for episode, pictures in shown}

    def understand(episode: Episode, text: str) -> bool:
        return model.understand_seen(episode.task, text, seen[episode.key]) == episode.goal

    return understand
