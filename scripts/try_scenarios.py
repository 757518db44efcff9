"""Try out scenarios: what a listener learns of it, and what gives its goals away.

`listener` trains a listener on the scenarios of the train pool, and prints which percentage of
goals it gets in scenes that it never saw, in known scenarios and in those of the test pool. It is
given where things stand, so no picture is drawn. `--without words` or `--without pictures` makes
it a floor. It needs roboirg-learn and PyTorch.

`frames` prints which percentage of goals follows from the frame of a scenario and the classes of
its pointers alone, and the frames that give their goals away.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import typer

from roboirg.core.episode import values_in
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.extension.commands import known_name
from roboirg.extension.sight import class_of
from roboirg.language.landmarks import WORK_AREA
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.settings import all_settings
from roboirg.language.variants import instructions
from roboirg.shortcuts.goal_learner import InstructedEpisode
from roboirg.shortcuts.shortcut_scores import counted_slots
from roboirg.tasks.splits.splits import get_episode

if TYPE_CHECKING:
    from roboirg_learn.listener.reader_training import Lesson

TASKS = tuple(written_words())
LEARNED, TESTED = 800_000, 900_000
"""Numbers of the first random scene to learn from, and to test on."""
GROUP = ["setting", "task", "pool"]
CLUES = {
    "majority": [],
    "derivation": ["derived"],
    "by frame": ["frame"],
    "by class": ["class"],
    "by both": ["frame", "class"],
}
"""From what a goal is guessed, beyond the slots that the command leaves open. The derivation of a
reasoning text, such as *two more*, excludes some numbers by itself."""
MOST, FEWEST = 5, 30
"""Points over the majority that a guess from frame and classes may gain; texts of a frame that is
named for more."""
app = typer.Typer(help=__doc__)


def told_in(pool: str, first: int, scenes: int) -> Iterator[InstructedEpisode]:
    """Yield the texts of random scenes of each task, in all settings."""
    options = InstructionOptions(wordings=pool)
    episodes = (
        get_episode(task, "random", first + number) for task in TASKS for number in range(scenes)
    )
    yield from instructions(episodes, tuple(all_settings()), ("implicit",), options)


def clues_of(pool: str, one: InstructedEpisode) -> dict[str, object]:
    """Return what a text can be guessed from, and its goal: the values of the open slots."""
    said = one[1]
    goal = {slot: values_in(one[0].goal[slot]) for slot in counted_slots(one)}
    return {
        **dict(zip(GROUP, (said.setting, said.task, pool), strict=True)),
        "open": str([(slot, len(values)) for slot, values in goal.items()]),
        "derived": f"{said.metadata['pattern']} {said.metadata['relation']}",
        "frame": said.metadata["scenario"],
        "class": str(
            [each.expression for each in said.mentions if each.utterance == len(said.turns) - 1]
        ),
        "goal": str(goal),
    }


@app.command()
def frames(scenes: int = 2000) -> None:
    """Print how far frame and classes give goals away, learned from one half of the texts."""
    texts = pd.DataFrame(
        clues_of(pool, one)
        for pool in POOLS
        for one in told_in(pool, TESTED, scenes)
        if "scenario" in one[1].metadata
    )
    texts["half"] = np.arange(len(texts)) // 7 % 2  # reasoning's patterns take turns
    for name, clues in CLUES.items():
        keys = [*GROUP, "open", "half", *clues]
        guesses = texts.groupby(keys).goal.agg(lambda goals: goals.mode()[0]).rename("guess")
        others = guesses.reset_index().assign(half=lambda found: 1 - found.half)
        found = texts.merge(others, "left", keys).guess
        texts[f"{name} guess"] = (
            found if name == "majority" else found.fillna(texts["majority guess"])
        )
        texts[name] = 100.0 * (texts[f"{name} guess"] == texts.goal)
    texts["gain"] = texts["by both"] - texts["majority"]
    of_groups = texts.groupby(GROUP)
    print(of_groups[[*CLUES]].mean().assign(texts=of_groups.size()).round(1).to_string())
    gains = texts.groupby([*GROUP, "frame"]).gain.agg(["size", "mean", "sem"])
    helps = gains[(gains["size"] >= FEWEST) & (gains["mean"] > np.maximum(MOST, 3 * gains["sem"]))]
    print(
        f"\nFrames that gain more than {MOST} points and three errors:\n{helps.round().to_string()}"
    )


def lessons_of(
    texts: Sequence[InstructedEpisode], classes: Sequence[str], without: str
) -> Iterator[Lesson]:
    """Yield texts with their goals and what is seen; hidden things are seen before they are."""
    from roboirg_learn.listener.learned_model import WITHOUTS, hide
    from roboirg_learn.listener.object_relations import corners_of, rank
    from roboirg_learn.listener.reader_training import lesson_of
    from roboirg_learn.listener.vocabulary import ListenerInput

    corners = corners_of(np.array(list(WORK_AREA.values())).reshape(2, 2))
    for episode, said in texts:
        covers = ("container", "hidden_cube") if episode.scene.of_kind("hidden_cube") else ("",)
        views = [[one for one in episode.scene.objects if one.kind != kind] for kind in covers]
        kinds = [np.array([classes.index(class_of(one)) for one in view]) for view in views]
        places = np.array([one.position[:2] for view in views for one in view])
        seen = rank(kinds, places, corners, classes)
        given = ListenerInput(said.task, said.text, seen)
        yield lesson_of(hide(given, known_name("variant", without, WITHOUTS)), episode)


@app.command()
def listener(
    scenes: int = 1500,
    tested: int = 200,
    passes: int = 4,
    without: str = "none",
    kept: Path = Path("listener-trial.pt"),
) -> None:
    """Train a listener on random scenes, and print what it gets; `kept` has what is unfinished."""
    import torch

    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.listener.reader_training import train_reader
    from roboirg_learn.listener.vocabulary import make_vocabulary
    from roboirg_learn.trainer import KeptTraining

    torch.set_num_threads(1)
    torch.manual_seed(0)
    learned = list(told_in("train", LEARNED, scenes))
    words = [said.text for _, said in learned]
    classes = sorted({class_of(one) for told in learned for one in told[0].scene.objects})
    made_of = [hashlib.sha256("\n".join(words).encode()).hexdigest(), without, passes]
    reader = train_reader(
        list(lessons_of(learned, classes, without)), make_vocabulary(words, classes, TASKS),
        ReaderPlan(TASKS, reader_epochs=passes),
        lambda *done: print(*done, flush=True), KeptTraining(kept, made_of),
    )  # fmt: skip
    answers = []
    for pool in POOLS:
        texts = list(told_in(pool, TESTED, tested))
        for (_, said), lesson in zip(texts, lessons_of(texts, classes, without), strict=True):
            is_right = int(reader([lesson.given])[0].argmax()) == lesson.goal
            answers.append((said.setting, said.task, pool, 100.0 * is_right))
    found = pd.DataFrame(answers, columns=[*GROUP, "right"])
    table = found.pivot_table("right", ["setting", "pool"], "task", margins=True)
    print(f"\n{len(words):,} texts learned, without {without}\n{table.round().to_string()}")


if __name__ == "__main__":
    app()
