"""A blind sheet of texts to be rated: shuffled, without task or setting, and a key to it.

One text for each frame, from random scenes, so that it is new to every rater. Each rater gets an
order of his or her own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.csv_text import csv_text
from roboirg.util.random_draws import shuffled

POOL = "test"
TEXTS = 44
"""Of each setting, each of another frame."""
RATERS = (1, 2, 3)
"""Each has a sheet in an order of its own."""
MOST_SCENES = 400
"""Scenes of a task that are looked at for a frame; each frame comes up long before the last."""

SampledText = Mapping[str, str | int]
"""A text to be rated: setting, task, frame of its scenario (empty if it has none), seed of the
scene, text."""


def draw_sample(tasks: Sequence[str], settings: Sequence[str], seed: int) -> list[SampledText]:
    """Return up to `TEXTS` texts of each setting for a blind rating, shuffled.

    Each is of another *frame*, the situation that a text describes, such as a school trip. Equal
    arguments give the same sample.

    Args:
        tasks: names.
        settings: names.
        seed: decides scenes and order.
    """
    rng = np.random.default_rng(seed)
    sample: list[SampledText] = []
    for setting in settings:
        texts: list[SampledText] = []
        for task in tasks:
            texts += _texts(task, setting, seed)
        # One text for each frame, as several tasks may have it. Texts of the explicit setting have
        # no frame, so each counts.
        of_frames = {text["frame"] or text["text"]: text for text in shuffled(rng, texts)}
        sample += list(of_frames.values())[:TEXTS]
    return shuffled(rng, sample)


def _texts(task: str, setting: str, seed: int) -> Iterator[SampledText]:
    """Yield a text of a task for each frame (the situation that it describes), up to `TEXTS`.

    They are from random scenes that only this seed uses, in the words of the test pool. In a
    setting without frames, each scene gives a text.
    """
    options = InstructionOptions(wordings=POOL)
    first = seed * MOST_SCENES  # number of a random scene
    episodes = (get_episode(task, "random", first + number) for number in range(MOST_SCENES))
    seen: set[str] = set()
    for episode, instruction in instructions(episodes, [setting], ["implicit"], options):
        if len(seen) >= TEXTS:
            return
        frame = str(instruction.metadata.get("scenario", ""))
        if frame in seen:
            continue
        seen.add(frame or episode.key)  # without frames, each episode counts
        yield {
            "setting": setting,
            "task": task,
            "frame": frame,
            "seed": episode.seed,
            "text": instruction.text,
        }


def sheet(texts: Sequence[SampledText], order: int) -> str:
    """Return a rater's sheet as CSV: number, text, and an empty column for the rating.

    Args:
        texts: of the sample, in the order of the key.
        order: seed of the order on this sheet; the number of a text is the same on all sheets.
    """
    rng = np.random.default_rng(order)
    numbered = shuffled(rng, list(enumerate(texts, 1)))
    rows = [{"number": number, "text": text["text"], "rating": ""} for number, text in numbered]
    return csv_text(rows)


def key(texts: Sequence[SampledText]) -> str:
    """Return a CSV with setting, task, frame, seed and text of each number on the sheets."""
    return csv_text([{"number": number, **text} for number, text in enumerate(texts, 1)])
