"""Reproducible choice of paraphrases, the same in all settings of an episode."""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from roboirg.core.episode import Episode
from roboirg.core.instruction_options import DEFAULT_LANGUAGE
from roboirg.language.templates import DRAWS, LANGUAGE_VERSIONS

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True)
class TemplateSampler:
    """Sampler of one episode; every purpose has its own stream of random numbers.

    A draw depends only on the key and the purpose, not on earlier draws, so that direct,
    contextual and resolved instructions share their words. A purpose is a hash key: another
    spelling draws other words.

    Attributes:
        key: of the language's draws, with task and seed.
        hashed: whether hashes alone draw, as in language 4, which takes a tenth of the time.
        log: ``purpose/index`` of every choice, in order.
    """

    key: str
    hashed: bool = False
    log: list[str] = field(default_factory=list)

    def pick(self, purpose: str, options: Sequence[Option]) -> Option:
        """Pick one of the options, all equally likely."""
        count = len(options)
        index = _drawn(self.key, purpose, count, hashed=self.hashed) if count > 1 else 0
        return self._take(purpose, options, index)

    def pick_named(self, purpose: str, options: Mapping[str, Option]) -> Option:
        """Pick one of the options, all equally likely; a further option takes some draws only.

        Each name has a number of its own, and the smallest number wins.
        """
        name = min(options, key=lambda name: _hash(self.key, f"{purpose}|{name}"))
        self.log.append(f"{purpose}/{name}")
        return options[name]

    def cycle(self, purpose: str, options: Sequence[Option]) -> Iterator[Option]:
        """Yield all options in random order, repeating the cycle forever; log what is used."""
        order = _shuffled(self.key, purpose, len(options), hashed=self.hashed)
        for index in itertools.cycle(order):
            yield self._take(purpose, options, index)

    def _take(self, purpose: str, options: Sequence[Option], index: int) -> Option:
        self.log.append(f"{purpose}/{index}")
        return options[index]


def sampler_of(
    episode: Episode, variant: int = 0, language: int = DEFAULT_LANGUAGE
) -> TemplateSampler:
    """Return the sampler of an episode; each variant draws its words anew, 0 is the usual one."""
    key = f"{episode.task}|{episode.seed}"
    return sampler_for(f"{key}|{variant}" if variant else key, language)


def sampler_for(key: str, language: int) -> TemplateSampler:
    """Return the sampler of a key in a language."""
    is_usual = language == DEFAULT_LANGUAGE
    draws = DRAWS if is_usual else LANGUAGE_VERSIONS[language]
    return TemplateSampler(f"{draws}|{key}", hashed=not is_usual)


def _hash(key: str, purpose: str) -> int:
    digest = hashlib.sha256(f"{key}|{purpose}".encode()).digest()
    return int.from_bytes(digest[:8], "little")


def _generator(key: str, purpose: str) -> np.random.Generator:
    """Return the random stream of a purpose, from its start."""
    return np.random.default_rng(_hash(key, purpose))


# Cached: all settings and forms of an episode draw the same.
@functools.lru_cache(maxsize=1024)
def _drawn(key: str, purpose: str, count: int, *, hashed: bool) -> int:
    if hashed:
        return _hash(key, purpose) % count
    return int(_generator(key, purpose).integers(count))


@functools.lru_cache(maxsize=1024)
def _shuffled(key: str, purpose: str, count: int, *, hashed: bool) -> tuple[int, ...]:
    if hashed:
        return tuple(sorted(range(count), key=lambda at: _hash(key, f"{purpose}|{at}")))
    return tuple(_generator(key, purpose).permutation(count).tolist())
