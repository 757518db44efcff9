"""Scenes of seeds, but for those that a sampler rejects."""

import contextlib
import itertools

import numpy as np

from roboirg.core.errors import SceneRejectedError
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import make_episode


def drawn(make, seeds):
    """Yield what is made of each seed that is not rejected; all seeds from 0 on if None."""
    for seed in itertools.count() if seeds is None else seeds:
        with contextlib.suppress(SceneRejectedError):
            yield make(seed)


def drawn_scenes(task, difficulty, seeds=None):
    """Yield scenes and goals of a task."""
    sample = get_task(task).sample
    return drawn(lambda seed: sample(np.random.default_rng(seed), difficulty), seeds)


def drawn_episodes(task, difficulty, seeds=None):
    return drawn(lambda seed: make_episode(task, seed, difficulty), seeds)
