"""Worlds without a simulator for hosted policies, with secrets, and the run that is killed."""

from __future__ import annotations

import dataclasses
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roboirg.runs.job_instruction import instruct_job
from roboirg.runs.plan.plan import Plan
from roboirg.runs.play import rollout
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.run.executor import LocalProcesses
from roboirg.runs.run.runner import run_plan

LENGTH = 24
"""Control steps of an episode."""
WHISPER = "the goal is the cube with the token {} of seed 8675309"


class FakeWorld:
    """Ends after `LENGTH` steps; its events tell the policy's actions, and the verdict too."""

    render_device = "none"

    def __init__(self, job, seconds=0.0):
        self.instruction = instruct_job(job)
        self.secret = WHISPER.format(job.episode)
        self.seconds = seconds
        self.steps = 0
        self.total = 0.0
        self.executed_actions = 0

    def reset(self):
        video = np.arange(5 * 4 * 4 * 3, dtype=np.uint8).reshape(5, 4, 4, 3)
        demonstration = {"front_rgb": video, "joint_positions": np.zeros((5, 7))}
        info = {"demonstration": demonstration, "demonstration_source": "planned"}
        now = {"status": "ongoing", "heard": []}
        return self.observation(), {**info, **now, "elapsed_steps": 5, "events": []}

    def observation(self):
        return {
            "front_rgb": np.full((256, 256, 3), self.steps, np.uint8),
            "joint_positions": np.full(7, self.steps / 10, np.float32),
            "instruction": self.instruction.text,
        }

    def step_chunk(self, rows):
        time.sleep(self.seconds)
        self.steps = min(self.steps + len(rows), LENGTH)
        self.total += float(np.sum(rows))
        self.executed_actions += len(rows)
        event = {"step": self.steps, "kind": "picked", "subject": f"{self.total:.9f}"}
        over = self.steps == LENGTH
        status = ("success" if self.total > 0 else "failure") if over else "ongoing"
        info = {"status": status, "steps": self.steps, "events": [event], "heard": []}
        return self.observation(), 0.0, over, False, info

    attempts = ()

    def end_state(self):
        return np.zeros(3), "paper"

    def close(self):
        pass


@dataclass(frozen=True)
class FakeWorldRunner(EpisodeRunner):
    """Plays in worlds without a simulator.

    Attributes:
        seconds: how long a chunk takes.
        notes: where the process ids of worlds are noted.
    """

    seconds: float = 0.0
    notes: Path | None = None

    def __call__(self, job):
        if self.notes is not None:
            (self.notes / f"worker-{os.getpid()}").touch()
        kept = rollout.make_env
        rollout.make_env = lambda prepared, _needs: FakeWorld(prepared.job, self.seconds)
        try:
            return EpisodeRunner.__call__(self, job)
        finally:
            rollout.make_env = kept  # this may be the process of all tests


@dataclass(frozen=True)
class PatientRunner(FakeWorldRunner):
    """Plays when as many worlds as wanted have come.

    Attributes:
        wanted: number of processes with a world.
    """

    wanted: int = 1

    def __call__(self, job):
        assert self.notes is not None
        (self.notes / f"worker-{os.getpid()}").touch()
        deadline = time.monotonic() + 300
        while len(list(self.notes.glob("worker-*"))) < self.wanted:
            if time.monotonic() > deadline:
                raise RuntimeError("The other processes did not come.")
            time.sleep(0.05)
        return super().__call__(job)


class Dice:
    """Draws from the global generators, which belong to one episode at a time."""

    cameras = ("front",)
    version = "1"

    def __init__(self, seed=0):
        self.seed = seed
        self.metadata = {"seed": seed}
        self.calls = 0

    def reset(self, instruction, demonstration):
        np.random.seed(self.seed)  # noqa: NPY002
        self.instruction = instruction
        self.start = float(demonstration["front_rgb"].sum())

    def act(self, observation):
        self.calls += 1
        assert int(observation["front_rgb"][0, 0, 0]) == round(
            10 * float(observation["joint_positions"][0])
        )
        rows = np.random.standard_normal((4, 8))  # noqa: NPY002
        return rows + self.start * 1e-6

    def usage(self):
        return {"calls": self.calls}


class Resident(Dice):
    """Tells in which process it is."""

    def usage(self):
        return {"process": os.getpid()}


class BatchedDice:
    """The same numbers for several episodes at once; notes how many."""

    cameras = ("front",)
    version = "1"
    made = 0

    def __init__(self):
        type(self).made += 1
        self.metadata = {"made": self.made}

    def begin(self, instruction, demonstration, seed):
        return np.random.default_rng(seed)

    def act_batch(self, states, observations):
        time.sleep(0.01)
        note = os.environ.get("ROBOIRG_TEST_SIZES")
        if note:
            with Path(note).open("a") as file:
                file.write(f"{len(states)}\n")
        return [state.standard_normal((4, 8)) for state in states]


class Picky(BatchedDice):
    """Cannot answer some of the episodes."""

    made = 0

    def begin(self, instruction, demonstration, seed):
        return (np.random.default_rng(seed), seed % 3 == 0)

    def act_batch(self, states, observations):
        time.sleep(0.01)
        if any(bad for _, bad in states):
            raise ValueError("one of them is bad")
        return [rng.standard_normal((4, 8)) for rng, _ in states]


def fake_world_plan(policy, episodes=8, seeds=1, **options):
    return Plan(
        policies=(f"{Path(__file__).stem}:{policy}" if policy.isidentifier() else policy,),
        tasks=("PickXtimes",),
        settings=("direct",),
        episodes=tuple(range(episodes)),
        policy_seeds=tuple(range(seeds)),
        **options,
    )


def fake_world_runner(plan, folder, seconds=0.0):
    return FakeWorldRunner(
        folder,
        policy_timeout_s=plan.hosting.policy_timeout_s,
        hosting=plan.hosting.settings,
        seconds=seconds,
        notes=folder,
    )


KILLED_PLAN = fake_world_plan("BatchedDice", 25, policy_timeout_s=60.0)

if __name__ == "__main__":
    out = Path(sys.argv[1])
    sys.path.insert(0, str(Path(__file__).parent))
    # As if it had been opened, which would take most of the time between two kills.
    opened = {"policies": (dataclasses.replace(KILLED_PLAN.policies[0], version="1"),)}
    plan = KILLED_PLAN.model_copy(update=opened)
    run_plan(plan, out, fake_world_runner(plan, out, 0.02), LocalProcesses(3))
