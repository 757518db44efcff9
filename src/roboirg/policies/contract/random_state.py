"""Global random generators for episodes that share a process.

Episodes take *turns*: without this, one would change the random numbers of others.
"""

from __future__ import annotations

import random
import sys
from typing import Any

import numpy as np


class RandomState:
    """The states of the global random generators, as one episode left them.

    `restore` before the episode's turn, `keep` after it. PyTorch's generators are seeded in the
    first turn after an import of it.

    Args:
        seed: of all generators at the beginning of the episode.
    """

    def __init__(self, seed: int) -> None:
        """Make the states that generators have right after seeding; the process's own stay."""
        self._seed = seed
        self._python = random.Random(seed).getstate()
        self._numpy: Any = np.random.RandomState(seed % 2**32).get_state()
        self._torch: Any = None
        """PyTorch, once the episode has seeded its generators; None before."""
        self._torch_processor: Any = None
        """State of PyTorch's generator of the processor."""
        self._torch_devices: Any = ()
        """States of PyTorch's generators of devices."""

    def keep(self) -> None:
        """Take over the states of this process's generators, after the episode's turn."""
        self._python = random.getstate()
        self._numpy = np.random.get_state()  # noqa: NPY002
        if self._torch is not None:
            self._torch_processor = self._torch.get_rng_state()
            if self._torch.cuda.is_initialized():
                self._torch_devices = self._torch.cuda.get_rng_state_all()

    def restore(self) -> None:
        """Set this process's generators to these states, before the episode's turn."""
        random.setstate(self._python)
        np.random.set_state(self._numpy)  # noqa: NPY002 - what policies may use
        if self._torch is not None:
            self._torch.set_rng_state(self._torch_processor)
            if self._torch_devices:
                self._torch.cuda.set_rng_state_all(self._torch_devices)

    def seed_torch(self) -> None:
        """Seed PyTorch's generators if it is imported and the episode has not seeded them."""
        torch = sys.modules.get("torch")
        if self._torch is None and torch is not None:
            torch.manual_seed(self._seed)
            self._torch = torch


class RandomTurns:
    """Gives the global random generators of this process to one episode after the other.

    States are exchanged only when another episode takes its turn, because that takes 0.1 ms.
    """

    def __init__(self) -> None:
        self._episode: RandomState | None = None
        """Of the episode whose numbers the generators give; None between turns."""

    def begin(self, episode: RandomState) -> None:
        """Let the generators give the numbers of an episode, until the turn of another or `end`."""
        if self._episode is not episode:
            self.end()
            self._episode = episode
            episode.restore()
        episode.seed_torch()

    def end(self) -> None:
        """Keep the states of the episode whose turn it is.

        What draws numbers next, outside of any turn, does not change those of an episode.
        """
        episode = self._episode
        self._episode = None
        if episode is not None:
            episode.keep()
