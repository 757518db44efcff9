"""A policy that repeats recorded actions, the same in every harness.

It knows an episode by its first picture and its instruction, so it fails loudly where a harness
shows another episode, other pictures or other words. A third of the recordings is whole; the others
stop half-way or belong to another episode.
"""

import hashlib
import os
from pathlib import Path

import numpy as np

import roboirg
from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.policies import make_policy
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record import Job
from roboirg.runs.play.rollout import EpisodeRunner

TASKS = ("VideoUnmask", "ButtonUnmask", "VideoUnmaskSwap", "StopCube", "VideoPlaceOrder")
SETTING = "contextual"
MESHES = "light"
MAX_STEPS = 230
EPISODES = int(os.environ.get("ROBOIRG_EQUALITY_EPISODES", "4"))
MANY = EPISODES >= 40
"""Whether all tasks and all sizes of batches are played."""
PLAYED = TASKS if MANY else TASKS[:1]
PER_TASK = EPISODES // len(PLAYED)


def in_batches_of(count):
    """Return what the programs of docs/integrations.md say of the episodes, and what to say."""
    played = f"{list(PLAYED)}, {SETTING!r}, {count}, {PER_TASK}"
    return {'["PickXtimes", "VideoUnmask"], "contextual", 8, 50': played}


def cases():
    """Return task and number of each episode."""
    return [(task, number) for task in PLAYED for number in range(PER_TASK)]


def key_of(picture, instruction):
    """Return the key of an episode: of its first front picture, uint8 (256, 256, 3), and words."""
    content = np.ascontiguousarray(picture, np.uint8).tobytes() + instruction.encode()
    return hashlib.sha256(content).hexdigest()


def record_table(path):
    """Record the oracle in the episodes of `cases` and write the table of their keys."""
    recorded = [_record(*case) for case in cases()]
    table = {}
    for index, (key, rows) in enumerate(recorded):
        played = (rows, rows[: len(rows) // 2], recorded[index - 1][1])[index % 3]
        table[key] = played.astype(np.float32)
    np.savez(path, **table)


def _record(task, episode):
    env = roboirg.make(
        task,
        setting=SETTING,
        episode=episode,
        cameras=("front",),
        meshes=MESHES,
        demonstration_frames="none",
    )
    observation, info = env.reset()
    key = key_of(observation["front_rgb"], observation["instruction"])
    policy = make_policy("oracle", 0)
    rows = []
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

    def play(self, picture, instruction):
        """Yield the actions of an episode; the last one for ever."""
        rows = self.table[key_of(picture, instruction)]
        yield from rows
        while True:
            yield rows[-1]


class ReplayPolicy:
    """The replaying policy for our own runner; the variable REPLAY_TABLE names its table."""

    cameras = ("front",)
    demonstration_frames = "none"

    def __init__(self, seed=0):
        self.replay = Replay(os.environ["REPLAY_TABLE"])
        self.player = None

    def reset(self, instruction, demonstration):
        self.player = None

    def act(self, observation):
        if self.player is None:
            words = observation["instruction"]
            self.player = self.replay.play(observation["front_rgb"], words)
        return next(self.player)[None]


def own_outcomes(spec, meshes=MESHES):
    """Return (task, episode, whether it succeeded, steps) of each episode in our own runner."""
    played = []
    for task, episode in cases():
        job = Job(
            policy="replay",
            ref=read_policy(spec, "replay"),
            task=task,
            split="test",
            episode=episode,
            environment=EnvironmentOptions(MAX_STEPS, meshes=meshes),
            options=InstructionOptions(SETTING),
        )
        record, _ = EpisodeRunner(Path()).play_once(job)
        assert record.outcome in ("success", "failure"), record
        played.append((task, episode, record.outcome == "success", record.steps))
    for task in PLAYED:
        assert {success for name, _, success, _ in played if name == task} == {True, False}, task
    return played
