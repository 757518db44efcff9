"""A blind sheet of texts to be rated: shuffled, without task or setting, and a key to it.

One text for each frame, from random scenes, so that it is new to every rater; texts of language 3
among them anchor the ratings. Each rater gets an order of his or her own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from roboirg.core.instruction_options import DEFAULT_LANGUAGE, InstructionOptions
from roboirg.language.settings import EXPLICIT
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.csv_text import csv_text
from roboirg.util.random_draws import shuffled

LANGUAGE = 4
POOL = "test"
TEXTS = 44
"""Of each setting, each of another frame."""
RATERS = (1, 2, 3)
"""Each has a sheet in an order of its own."""
MOST_SCENES = 400
"""Scenes of a task that are looked at for a frame; each frame comes up long before the last."""

SampledText = Mapping[str, str | int]
"""A text to be rated: setting, language, task, frame of its scenario (empty if it has none), seed
of the scene, text."""


def draw_sample(
    tasks: Sequence[str], settings: Sequence[str], anchors: int, seed: int
) -> list[SampledText]:
    """Return up to `TEXTS` texts of each setting, and as many anchors over all, shuffled."""
    rng = np.random.default_rng(seed)
    found, old = list[SampledText](), list[SampledText]()
    for setting in settings:
        every = [one for task in tasks for one in _texts(task, setting, LANGUAGE, seed, TEXTS)]
        # Tasks share frames; explicit has none.
        of_frames = {text["frame"] or text["text"]: text for text in shuffled(rng, every)}
        found += list(of_frames.values())[:TEXTS]
        for task in tasks:
            old += _texts(task, setting, DEFAULT_LANGUAGE, seed, anchors)
    found += shuffled(rng, old)[:anchors]
    return shuffled(rng, found)


def _texts(task: str, setting: str, language: int, seed: int, number: int) -> Iterator[SampledText]:
    """Yield a text for each frame; without frames, as many as are asked for."""
    options = InstructionOptions(language=language, wordings=POOL)
    scenes = range(seed * MOST_SCENES, (seed + 1) * MOST_SCENES)
    episodes = (get_episode(task, "random", index) for index in scenes)
    frames: set[str] = set()
    for episode, told in instructions(episodes, [setting], ["implicit"], options):
        frame = str(told.metadata.get("scenario", ""))
        if len(frames) >= number:
            return
        if frame not in frames:
            has_frames = setting != EXPLICIT and language == LANGUAGE
            frames.add(frame if has_frames else episode.key)
            yield {
                "setting": setting, "language": language, "task": task, "frame": frame,
                "seed": episode.seed, "text": told.text,
            }  # fmt: skip


def sheet(texts: Sequence[SampledText], order: int) -> str:
    """Return a rater's sheet: number and text in an order of its own, and a column to fill in."""
    rng = np.random.default_rng(order)
    rows = [
        {"number": number, "text": text["text"], "rating": ""}
        for number, text in shuffled(rng, list(enumerate(texts, 1)))
    ]
    return csv_text(rows)


def key(texts: Sequence[SampledText]) -> str:
    """Return what the numbers of the sheets stand for."""
    return csv_text([{"number": number, **one} for number, one in enumerate(texts, 1)])
