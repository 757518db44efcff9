"""Seeds of policies, and global random generators for episodes that share a process."""

from __future__ import annotations

import random
import sys
from types import TracebackType
from typing import Any

import numpy as np


def episode_policy_seed(policy_seed: int, episode_seed: int) -> int:
    """Return a policy's seed in an episode: the same in every setting, another in every episode.

    Args:
        policy_seed: of the run.
        episode_seed: of the episode's scene.
    """
    return int(np.random.SeedSequence((policy_seed, episode_seed)).generate_state(1)[0])


class RandomState:
    """The global random generators of this process, as one episode left them; a context.

    Episodes take turns in a process: without this, one would change the random numbers of others.

    Args:
        seed: of all generators at the beginning of the episode.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._python = random.Random(seed).getstate()
        self._numpy: Any = np.random.RandomState(seed % 2**32).get_state()
        self._torch: tuple[Any, ...] | None = None

    def __enter__(self) -> None:
        random.setstate(self._python)
        np.random.set_state(self._numpy)  # noqa: NPY002 - what policies may use
        torch = sys.modules.get("torch")
        if torch is not None and self._torch is None:
            torch.manual_seed(self._seed)
        elif torch is not None and self._torch is not None:
            processor, *devices = self._torch
            torch.set_rng_state(processor)
            if devices:
                torch.cuda.set_rng_state_all(devices)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._python, self._numpy = random.getstate(), np.random.get_state()  # noqa: NPY002
        torch = sys.modules.get("torch")
        if torch is not None:
            devices = torch.cuda.get_rng_state_all() if torch.cuda.is_initialized() else ()
            self._torch = (torch.get_rng_state(), *devices)
