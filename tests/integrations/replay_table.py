"""A policy that repeats recorded actions, the same in every harness.

It knows an episode by its first picture and its instruction, so it fails loudly where a harness
shows another episode, other pictures or other words. A third of the recordings succeeds; the others
stop half-way or belong to another episode.
"""

import hashlib
from pathlib import Path

import numpy as np

import roboirg
from roboirg.policies import make_policy

TASK = "VideoUnmask"
SETTING = "spatial"
MESHES = "light"
MAX_STEPS = 110


def key_of(picture, instruction):
    """Return the key of an episode: of its first front picture, uint8 (256, 256, 3), and words."""
    content = np.ascontiguousarray(picture, np.uint8).tobytes() + instruction.encode()
    return hashlib.sha256(content).hexdigest()


def record_table(path: Path, episodes: int) -> None:
    """Record the oracle in the first episodes and write the table of their keys."""
    recorded = [_record(episode) for episode in range(episodes)]
    table = {}
    for episode, (key, rows) in enumerate(recorded):
        played = (rows, rows[: len(rows) // 2], recorded[episode - 1][1])[episode % 3]
        table[key] = played.astype(np.float32)
    np.savez(path, **table)


def _record(episode):
    env = roboirg.make(
        TASK, setting=SETTING, episode=episode, cameras=("front",), meshes=MESHES,
        demonstration_frames="none",
    )  # fmt: skip
    observation, info = env.reset()
    key = key_of(observation["front_rgb"], observation["instruction"])
    policy, rows = make_policy("oracle", 0), []
    policy.attach(env)
    policy.reset(observation["instruction"], info["demonstration"])
    env.draws = False
    while info["status"] == "ongoing":
        rows.append(policy.act({}))
        *_, info = env.step_chunk(rows[-1])
    env.close()
    return key, np.concatenate(rows)


class Replay:
    """The rows of one episode, one after the other; the last one is repeated.

    Args:
        table: file that `record_table` wrote.
    """

    def __init__(self, table):
        with np.load(table) as arrays:
            self.table = dict(arrays)

    def begin(self, picture, instruction):
        return iter(self.table[key_of(picture, instruction)])

    @staticmethod
    def next_row(rows, last):
        return next(rows, last)
