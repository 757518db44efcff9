"""Which paraphrase an episode gets: stable, and the same in all settings."""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True)
class TemplateSampler:
    """Draws for one episode; every purpose has its own stream of random numbers.

    A draw depends on the key and the purpose only, never on which draws were made before: this
    is what lets direct, contextual and resolved instructions share their words.

    Attributes:
        key: language version, task and seed.
        log: ``purpose/index`` of everything that was chosen, in order.
    """

    key: str
    log: list[str] = field(default_factory=list)

    def pick(self, purpose: str, options: Sequence[Option]) -> Option:
        """One of the options, all equally likely."""
        return self._take(purpose, options, _drawn(self.key, purpose, len(options)))

    def endless(self, purpose: str, options: Sequence[Option]) -> Iterator[Option]:
        """All the options in random order, again and again; what is taken is logged."""
        for index in itertools.cycle(_shuffled(self.key, purpose, len(options))):
            yield self._take(purpose, options, index)

    def _take(self, purpose: str, options: Sequence[Option], index: int) -> Option:
        self.log.append(f"{purpose}/{index}")
        return options[index]


def _generator(key: str, purpose: str) -> np.random.Generator:
    """The stream of a purpose, from its beginning."""
    # Language 1.1 drew with the British spelling; another one would draw other words.
    spelled = purpose.replace("color", "colour")
    digest = hashlib.sha256(f"{key}|{spelled}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


# Kept, because the settings and forms of an episode draw the same.
@functools.lru_cache(maxsize=1024)
def _drawn(key: str, purpose: str, count: int) -> int:
    return int(_generator(key, purpose).integers(count))


@functools.lru_cache(maxsize=1024)
def _shuffled(key: str, purpose: str, count: int) -> tuple[int, ...]:
    return tuple(_generator(key, purpose).permutation(count).tolist())
