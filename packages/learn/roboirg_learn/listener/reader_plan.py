"""How a reader of words is trained: that of a listener, or of a policy."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import NonNegativeInt, PositiveInt

from roboirg.extension.episodes import ENVIRONMENT_VERSION, language_label, plain_settings
from roboirg_learn.listener.vocabulary import USUAL_ENCODERS, WordPool

WORDLESS = "none"
"""In the place of a pool of words, for a reader that is trained without any."""


class ReaderPlan(NamedTuple):
    """How a reader is trained.

    Attributes:
        tasks: names of tasks.
        settings: names of settings whose instructions it hears, harder ones where they can express
            the episode; () for a reader without words.
        words: the pool of words, ``train`` or ``test``.
        scenes: random scenes of each task beyond the train split.
        goals: how many goals of each scene are heard in implicit settings, where the meaning
            depends on the scene and on what was said before; in explicit and harder settings only
            the scene's own is heard.
        reader_epochs: passes over all instructions.
        seed: of initial weights and order.
        encoders: keyword arguments of each encoder, by its name in `ENCODERS`.
    """

    tasks: tuple[str, ...]
    settings: tuple[str, ...] = ("explicit",)
    words: WordPool = "train"
    scenes: NonNegativeInt = 300
    goals: PositiveInt = 4
    reader_epochs: PositiveInt = 12
    seed: NonNegativeInt = 0
    encoders: Mapping[str, dict[str, Any]] = USUAL_ENCODERS

    @property
    def heard(self) -> str:
        """The settings that it hears, for names of files: ``all``, ``none`` or ``a-b``."""
        if set(self.settings) == set(plain_settings()):
            return "all"
        return "-".join(self.settings) or WORDLESS

    @property
    def about(self) -> dict[str, Any]:
        """All that a reader depends on besides what it sees, as plain JSON data."""
        words = self.words if self.settings else WORDLESS
        label = language_label(self.tasks, self.words, self.settings)
        return as_plain({**self._asdict(), "words": words, "language_version": label})


def as_plain(about: Mapping[str, Any]) -> dict[str, Any]:
    """Return a plan as plain JSON data (lists for tuples), with the environment's version."""
    whole = {**about, "environment_version": ENVIRONMENT_VERSION}
    return dict(json.loads(json.dumps(whole)))
