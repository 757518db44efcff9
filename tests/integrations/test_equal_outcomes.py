"""One policy, the same outcomes: in our runner, vector environment, and LeRobot's batches."""

import itertools
import os
from pathlib import Path

import numpy as np
import pytest
from replay_table import MAX_STEPS, MESHES, SETTING, TASK, Replay, key_of, record_table

import roboirg
from roboirg.evaluation.rollout import play_episode
from roboirg.integrations.lerobot.vector import make_batch
from roboirg.records.record import Job

pytestmark = pytest.mark.sim

HERE = Path(__file__).parent
EPISODES = int(os.environ.get("ROBOIRG_EQUALITY_EPISODES", "3"))
BATCHES = [(2, True)]
if EPISODES >= 40:
    BATCHES = [(n, in_processes) for n in (1, 2, 8) for in_processes in (False, True)]


HOLD = np.zeros((1, 8))


class ReplayPolicy:
    """The replaying policy for our own runner; acts in chunks of 16."""

    cameras = ("front",)
    demonstration_frames = "none"
    table = None

    def __init__(self, seed=0):
        self.replay, self.rows = Replay(self.table), None

    def reset(self, instruction, demonstration):
        self.rows = None

    def act(self, observation):
        if self.rows is None:
            words = observation["instruction"]
            self.rows = chunks(self.replay, observation["front_rgb"], words)
        return next(self.rows)


def chunks(replay, picture, words):
    """Yield the recording of an episode in chunks of 16 rows; the last row for ever."""
    rows = replay.table[key_of(picture, words)]
    for first in range(0, len(rows), 16):
        yield rows[first : first + 16]
    while True:
        yield np.repeat(rows[-1:], 16, axis=0)


@pytest.fixture(scope="module")
def replay(tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "table.npz"
    record_table(path, EPISODES)
    ReplayPolicy.table = path
    return Replay(path)


@pytest.fixture(scope="module")
def ours(replay):
    job = Job(
        policy="replay", spec="test_equal_outcomes:ReplayPolicy", task=TASK, split="test",
        episode=0, setting=SETTING, max_steps=MAX_STEPS, meshes=MESHES,
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(HERE))
        import test_equal_outcomes as module

        module.ReplayPolicy.table = ReplayPolicy.table
        played = [
            play_episode(job.model_copy(update={"episode": episode})) for episode in range(EPISODES)
        ]
    assert {one.outcome for one in played} == {"success", "failure"}, played
    return [(one.outcome == "success", one.steps) for one in played]


@pytest.mark.parametrize(("count", "in_processes"), BATCHES)
def test_in_our_vector_environment(replay, ours, count, in_processes):
    vector = roboirg.make_vec(
        TASK, count, autoreset_mode="Disabled", workers=count if in_processes else 1, lazy=True,
        setting=SETTING, cameras=("front",), meshes=MESHES, max_steps=MAX_STEPS,
        demonstration_frames="none",
    )  # fmt: skip
    found = []
    for start in range(0, EPISODES, count):
        batch, infos = vector.reset(seed=start)
        players = [
            chunks(replay, *seen) if start + index < EPISODES else None
            for index, seen in enumerate(zip(batch["front_rgb"], batch["instruction"], strict=True))
        ]
        over = np.array([player is None for player in players])
        verdicts = [None] * count
        while not over.all():
            # What is over gets another episode, which does not count.
            for index in np.flatnonzero(over):
                players[index] = itertools.repeat(np.repeat(HOLD, 16, axis=0))
            rows = [next(player) for player in players]
            _, _, terminated, truncated, infos = vector.step_chunk(rows)
            for index in np.flatnonzero((terminated | truncated) & ~over):
                verdicts[index] = bool(infos["is_success"][index]), int(infos["steps"][index])
            ended = terminated | truncated
            over |= ended
            if ended.any() and not over.all():
                vector.reset(options={"reset_mask": ended})
        found += verdicts[: EPISODES - start]
    vector.close()
    assert found == ours


@pytest.mark.parametrize(("count", "in_processes"), BATCHES)
def test_in_lerobot_s_batches(replay, ours, count, in_processes):
    options = {
        "setting": SETTING, "cameras": ("front",), "meshes": MESHES, "max_steps": MAX_STEPS,
    }  # fmt: skip
    env = make_batch(TASK, count, in_processes, options)
    found = []
    for start in range(0, EPISODES, count):
        seeds = [1000 + start + index for index in range(count)]
        observation, _ = env.reset(seed=seeds, options={"lerobot_new_rollout": True})
        words = env.call("task_description")
        pictures = observation["pixels"]["front"]
        players = [
            rows_of(replay, picture, text)
            if start + index < EPISODES
            else itertools.repeat(HOLD[0])
            for index, (picture, text) in enumerate(zip(pictures, words, strict=True))
        ]
        done, success, steps = (np.zeros(count, kind) for kind in (bool, bool, int))
        while not done.all():
            actions = np.stack([next(player) for player in players]).astype(np.float32)
            _, _, terminated, truncated, infos = env.step(actions)
            steps += ~done
            success |= infos["is_success"] & ~done
            done |= terminated | truncated
        found += list(zip(success.tolist(), steps.tolist(), strict=True))[: EPISODES - start]
    env.close()
    assert found == ours


def rows_of(replay, picture, words):
    for chunk in chunks(replay, picture, words):
        yield from chunk
