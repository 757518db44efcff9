"""Which paraphrase an episode gets: stable, and the same in all settings."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True)
class Chooser:
    """Draws for one episode; every purpose has its own stream of random numbers.

    A draw depends on the key and the purpose only, never on which draws were made before: this
    is what lets direct, contextual and resolved instructions share their words.

    Attributes:
        key: language version, task and seed.
        log: ``purpose/index`` of every template that was chosen, in order.
    """

    key: str
    log: list[str] = field(default_factory=list)

    def generator(self, purpose: str) -> np.random.Generator:
        """The stream of a purpose, from its beginning."""
        digest = hashlib.sha256(f"{self.key}|{purpose}".encode()).digest()
        return np.random.default_rng(int.from_bytes(digest[:8], "little"))

    def pick(self, purpose: str, options: Sequence[Option]) -> Option:
        """One of the options, all equally likely."""
        return options[int(self.generator(purpose).integers(len(options)))]

    def template(self, purpose: str, templates: Sequence[Option]) -> Option:
        """One of the templates; its id is noted in the log."""
        index = int(self.generator(purpose).integers(len(templates)))
        self.log.append(f"{purpose}/{index}")
        return templates[index]

    def shuffled(self, purpose: str, options: Sequence[Option]) -> tuple[Option, ...]:
        """All the options in random order."""
        order = self.generator(purpose).permutation(len(options))
        return tuple(options[index] for index in order.tolist())
