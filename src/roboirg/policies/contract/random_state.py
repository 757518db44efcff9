"""Global random generators for episodes that share a process."""

from __future__ import annotations

import random
import sys
from types import TracebackType
from typing import Any, ClassVar

import numpy as np


class RandomState:
    """The global random generators of this process, as one episode left them; a context.

    Episodes take turns in a process: without this, one would change the random numbers of others.
    States are exchanged only when another episode takes its turn, because that takes 0.1 ms.

    Args:
        seed: of all generators at the beginning of the episode.
    """

    _active: ClassVar[RandomState | None] = None
    """Whose numbers the generators give; None between episodes."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._python = random.Random(seed).getstate()
        self._numpy: Any = np.random.RandomState(seed % 2**32).get_state()
        self._torch: tuple[Any, ...] | None = None
        """PyTorch's generators: of the processor, then of each device. None if the episode has not
        used PyTorch; empty before their states are kept for the first time."""

    def __enter__(self) -> None:
        if RandomState._active is not self:
            RandomState.set_aside()
            RandomState._active = self
            self._restore()
        torch = sys.modules.get("torch")
        if torch is not None and self._torch is None:
            torch.manual_seed(self._seed)
            self._torch = ()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the generators as they are until another episode needs them."""

    @classmethod
    def set_aside(cls) -> None:
        """Keep the state of the episode whose numbers the generators give.

        What draws numbers next, outside of any episode, does not change those of an episode.
        """
        active = cls._active
        cls._active = None
        if active is not None:
            active._keep()  # noqa: SLF001 - of the same class

    def _keep(self) -> None:
        """Keep the states of this process's generators, for the next turn of this episode."""
        self._python = random.getstate()
        self._numpy = np.random.get_state()  # noqa: NPY002
        torch = sys.modules.get("torch")
        if torch is not None and self._torch is not None:
            devices = ()
            if torch.cuda.is_initialized():
                devices = torch.cuda.get_rng_state_all()
            self._torch = (torch.get_rng_state(), *devices)

    def _restore(self) -> None:
        """Set this process's generators to the states that were kept."""
        random.setstate(self._python)
        np.random.set_state(self._numpy)  # noqa: NPY002 - what policies may use
        if self._torch:
            torch = sys.modules["torch"]
            processor, *devices = self._torch
            torch.set_rng_state(processor)
            if devices:
                torch.cuda.set_rng_state_all(devices)
