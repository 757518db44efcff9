"""A blind sheet of texts to be rated: shuffled, without task or setting, and a key to it.

One text for each frame, from random scenes, so that nobody has seen it; texts of language 3 among
them anchor the ratings. Each rater gets an order of his or her own.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from roboirg.core.instruction_options import DEFAULT_LANGUAGE, InstructionOptions
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.language.settings import EXPLICIT, settings_of
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

LANGUAGE = 4
POOL = "test"
RATERS = (1, 2, 3)
"""Each has a sheet in an order of its own."""
MOST_SCENES = 400
"""Scenes of a task that are looked at for a frame; each frame comes up long before the last."""


class SampledText(NamedTuple):
    """A text to be rated.

    Attributes:
        setting: in which it was said.
        language: version of the language.
        task: name of the task.
        frame: of its scenario; empty if it has none.
        seed: of the scene.
        text: what is said.
    """

    setting: str
    language: int
    task: str
    frame: str
    seed: int
    text: str


def draw_sample(
    tasks: Sequence[str], settings: Sequence[str], number: int, anchors: int, seed: int
) -> list[SampledText]:
    """Return up to `number` texts of each setting, and as many anchors over all, shuffled."""
    rng = np.random.default_rng(seed)
    found: list[SampledText] = []
    for setting in settings:
        every = [one for task in tasks for one in _texts(task, setting, LANGUAGE, seed, number)]
        found += [every[at] for at in rng.permutation(len(every))[:number]]
    old = [
        one
        for setting in settings
        for task in tasks
        for one in _texts(task, setting, DEFAULT_LANGUAGE, seed, anchors)
    ]
    found += [old[at] for at in rng.permutation(len(old))[:anchors]]
    return [found[at] for at in rng.permutation(len(found))]


def _texts(task: str, setting: str, language: int, seed: int, number: int) -> Iterator[SampledText]:
    """Yield a text for each frame; without frames, as many as are asked for."""
    if setting not in settings_of(get_task(task)):
        return
    options = InstructionOptions(setting, language=language, wordings=POOL)
    frames: set[str] = set()
    for index in range(seed * MOST_SCENES, (seed + 1) * MOST_SCENES):
        episode = get_episode(task, "random", index)
        if find_refusal(episode, options) is not None:
            continue
        told = instruct_with(episode, options)
        frame = str(told.metadata.get("scenario", ""))
        if frame in frames or len(frames) >= number:
            continue
        frames.add(frame if setting != EXPLICIT and language == LANGUAGE else str(index))
        yield SampledText(setting, language, task, frame, episode.seed, told.text)


def sheet(texts: Sequence[SampledText], order: int) -> str:
    """Return a rater's sheet: number and text in an order of its own, and a column to fill in."""
    rng = np.random.default_rng(order)
    rows = [(at + 1, texts[at].text, "") for at in rng.permutation(len(texts)).tolist()]
    return _table(("number", "text", "rating"), rows)


def key(texts: Sequence[SampledText]) -> str:
    """Return what the numbers of the sheets stand for."""
    rows = [(number, *one) for number, one in enumerate(texts, 1)]
    return _table(("number", *SampledText._fields), rows)


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows([head, *rows])
    return out.getvalue()
