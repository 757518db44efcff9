"""Reproducible choice of words, the same in all settings of an episode."""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from roboirg.core.episode import Episode

LANGUAGE_VERSION = "4.7.0"
"""The version of all words. Every change of words needs a new one."""
DRAWS_VERSION = "4.5.0"
"""Key of all random draws: an older version, so that only the words that were mended change."""

Option = TypeVar("Option")


@dataclass(frozen=True, slots=True)
class WordSampler:
    """Draws the words of one episode; every purpose has a draw of its own.

    A draw depends only on the key and the purpose, not on earlier draws, so that direct, contextual
    and resolved instructions share their words. A purpose, such as ``"person"``, is a hash key:
    another spelling, or another order of the options, draws other words.

    Attributes:
        key: of the language's draws, with task and seed.
        log: ``purpose/index`` of every choice, in order; it goes into the metadata.
    """

    key: str
    log: list[str] = field(default_factory=list)

    def pick(self, purpose: str, options: Sequence[Option]) -> Option:
        """Return one of at least one options, all equally likely, and log its index."""
        index = _hash(self.key, purpose) % len(options) if len(options) > 1 else 0
        return self._take(purpose, options, index)

    def pick_named(self, purpose: str, options: Mapping[str, Option]) -> Option:
        """Return one of the options, all equally likely, and log its name.

        Each name has a random number of its own, and the smallest number wins. So a further option
        takes over some draws, and changes none of the others; the order of the options means
        nothing.
        """
        name = min(options, key=lambda name: _hash(self.key, f"{purpose}|{name}"))
        self.log.append(f"{purpose}/{name}")
        return options[name]

    def cycle(self, purpose: str, options: Sequence[Option]) -> Iterator[Option]:
        """Yield all options in random order, and then again in the same order, without end.

        Each is logged when it is taken. Nothing is yielded if there are no options.
        """
        order = sorted(range(len(options)), key=lambda at: _hash(self.key, f"{purpose}|{at}"))
        for index in itertools.cycle(order):
            yield self._take(purpose, options, index)

    def _take(self, purpose: str, options: Sequence[Option], index: int) -> Option:
        """Return the option at an index, and log it."""
        self.log.append(f"{purpose}/{index}")
        return options[index]


def sampler_of(episode: Episode, variant: int = 0) -> WordSampler:
    """Return the sampler of an episode.

    Each `variant` draws other words; 0 is the usual one.
    """
    key = f"{episode.task}|{episode.seed}"
    return sampler_for(f"{key}|{variant}" if variant else key)


def sampler_for(key: str) -> WordSampler:
    """Return the sampler of a key such as ``PickXtimes|1000``; equal keys draw the same."""
    return WordSampler(f"{DRAWS_VERSION}|{key}")


# Cached: all settings and forms of an episode draw the same.
@functools.lru_cache(maxsize=1024)
def _hash(key: str, purpose: str) -> int:
    """Return the number of a draw: 64 bits that depend on key and purpose alone."""
    digest = hashlib.sha256(f"{key}|{purpose}".encode()).digest()
    return int.from_bytes(digest[:8], "little")
