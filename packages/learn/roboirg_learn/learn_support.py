"""What all that learns needs: PyTorch and safetensors, and files that are made once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from roboirg.extension.commands import MissingDependencyError, parallel_map

if TYPE_CHECKING:
    from roboirg.extension.episodes import Episode


def check_learn_support() -> None:
    """Check early that PyTorch and safetensors are there, and let PyTorch use one thread.

    Networks this small are slower on two as soon as anything else runs.
    """
    try:
        import safetensors  # noqa: F401 - only whether it is there
        import torch
    except ImportError as error:
        raise MissingDependencyError(
            f"What is learned needs PyTorch and safetensors, which cannot be imported ({error}); "
            "run: pip install torch safetensors"
        ) from error
    torch.set_num_threads(1)


def make_missing_files(
    episodes: Sequence[Episode],
    path_of: Callable[[Episode], Path],
    make: Callable[[Episode], object],
    workers: int,
    show: Callable[[int, int], object],
) -> None:
    """Make the file of each episode that has none yet, so that a killed command goes on.

    Args:
        episodes: all of them.
        path_of: returns the file of an episode.
        make: writes that file, whole or not at all; runs in worker processes.
        workers: how many processes; 0 uses this one.
        show: called after each file with how many there are, and how many there will be.
    """
    missing = [episode for episode in episodes if not path_of(episode).exists()]
    done = len(episodes) - len(missing)
    for _ in parallel_map(make, missing, workers):
        done += 1
        show(done, len(episodes))
