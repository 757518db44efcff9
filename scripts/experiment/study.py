"""What the study trains, hears and plays, and what all that it stores depends on."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, TypeVar

import msgspec
import torch
from pydantic import BaseModel, BeforeValidator

import roboirg_learn
from experiment.store import Key, Store
from roboirg.core.delivery import SpokenInstruction
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.extension import sight
from roboirg.extension.episodes import goal_schema
from roboirg.records.record import Job
from roboirg.runs.job_instruction import PreparedJob, instruct_job
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.episode_record import code_fingerprints
from roboirg.util.processor import processor_family
from roboirg.util.short_hash import short_hash
from roboirg_learn.policy.learned_policy import LearnedPolicy
from roboirg_learn.policy.trained_body import load_body
from roboirg_learn.policy.trained_reader import HeardGoal, load_reader

TRUTH = "truth"
"""In the place of a reader: the true goal counts as heard."""
Memory = Literal["none", "framesamp", "ttt", "subgoal", "keyframes", "recurrent"]

body_of = functools.cache(load_body)
reader_of = functools.cache(load_reader)


def _names(value: object) -> object:
    """Return what is typed, ``none,ttt``, as names."""
    return value.split(",") if isinstance(value, str) else value


Item = TypeVar("Item")
Several = Annotated[list[Item], BeforeValidator(_names)]


class Study(BaseModel, extra="forbid"):
    """What the study trains, hears and plays.

    Attributes:
        name: of its tables.
        memories: of bodies.
        seeds: of training.
        readers: named after the settings whose words they have learned; or `TRUTH`.
        tasks: names of tasks; they are learned and played.
        settings: of what is said, as in the plan of a run; so are the next six.
        scenes: in which bodies are trained, and readers; the next four are of `BodyPlan`.
        reader_epochs: of each reader.
        same_code: fingerprints of earlier code that was proven to play alike; its plays count.
        results: folder of what stays: weights, hearings, plays and tables.
        work: folder of what can be made again: recordings, checkpoints, first looks.
        workers: processes that record, draw and play.
        proofs: how many trials a proof plays.
    """

    name: str
    memories: Several[Memory]
    seeds: Several[int]
    readers: Several[Literal["explicit", "all", "truth"]]
    tasks: str = "all"
    settings: str = "all"
    forms: str = "implicit"
    stages: list[list[int]] | None = None
    split: str = "test"
    episodes: str = "all"
    wordings: str = "test"
    max_steps: int = 1300
    scenes: int = 240
    drawn: int = 120
    detector_epochs: int = 8
    body_epochs: int = 24
    reader_epochs: dict[str, int] = {"explicit": 12, "all": 14}
    same_code: Several[str] = []
    results: Path = Path("results")
    work: Path = Path("build/experiment")
    workers: int = 2
    proofs: int = 40

    def rows(self) -> list[Row]:
        """Return every body with every reader."""
        weights = self.results.resolve() / "weights"
        rows = []
        for memory in self.memories:
            for seed in self.seeds:
                for reader in self.readers:
                    rows.append(Row(memory, reader, seed, weights))
        return rows

    def trials(self) -> Iterator[Trial]:
        """Yield every row with every episode in all its words."""
        said = {
            "tasks",
            "settings",
            "forms",
            "stages",
            "split",
            "episodes",
            "wordings",
            "max_steps",
        }
        plan = make_plan("oracle", **self.model_dump(include=said, exclude_none=True))
        jobs = [msgspec.structs.replace(job, policy="", ref=None) for job in plan.jobs()]
        for row in self.rows():
            for job in jobs:
                yield Trial(row, job)

    def open_store(self, name: str) -> Store:
        """Open the store of ``hearings``, or of ``plays``."""
        return Store(self.results / name, self.same_code)


class Row(NamedTuple):
    """A body and the reader of words that tells it the goal.

    Attributes:
        memory: of the body.
        heard: name of the reader.
        seed: with which both were trained.
        weights: folder of their files.
    """

    memory: str
    heard: str
    seed: int
    weights: Path

    @property
    def policy(self) -> str:
        """Its name in tables, where all seeds stand together: ``recurrent-all``."""
        return f"{self.memory}-{self.heard}"

    @property
    def body(self) -> Path:
        """File of the body."""
        return self.weights / f"{self.memory}-{self.seed}.body.safetensors"

    @property
    def reader(self) -> Path:
        """File of the reader; there is none for `TRUTH`."""
        return self.weights / f"{self.heard}-{self.seed}.reader.safetensors"


class Trial(NamedTuple):
    """An episode that a row plays in some words; the job has no policy."""

    row: Row
    job: Job

    @property
    def episode(self) -> Episode:
        """The episode with the goal by which the verdict falls."""
        return PreparedJob(self.job).episode

    @property
    def true_goal(self) -> HeardGoal:
        """The goal of the episode, as a reader hears it."""
        return HeardGoal(self.job.task, goal_schema(self.job.task).answers[self.episode.goal])

    @property
    def looks_name(self) -> str:
        """Of the file with the first looks: all that they depend on."""
        made_by = f"{_detector_of(self.row.body)}-{circumstances()['code']}"
        return f"{made_by}/{self.episode.key.replace('/', '-')}.npz"

    @property
    def hearing_key(self) -> Key:
        """All that decides what the row's reader hears."""
        return {
            "reader": file_hash(self.row.reader),
            "detector": _detector_of(self.row.body),
            "episode": self.episode.key,
            "text": short_hash(text_of(self.job)),
            **circumstances(),
        }

    def play_key(self, heard: HeardGoal) -> Key:
        """Return all that decides how the row's body plays: of the words, only the heard goal."""
        goal = dict(self.episode.goal.as_mapping())
        return {
            "body": file_hash(self.row.body),
            "episode": self.episode.key,
            "judged": json.dumps(goal, sort_keys=True),
            "heard": " ".join(heard),
            "max_steps": str(self.job.environment.max_steps),
            "actions": LearnedPolicy.actions,
            **circumstances(),
        }


@functools.cache
def circumstances() -> Key:
    """Return what everything that is stored depends on: code, versions, maker of the processor.

    The code is that which can change a verdict, and that which sees, understands and moves.
    """
    package = Path(roboirg_learn.__file__).parent
    code = code_fingerprints().verdict.encode()
    for path in (*sorted(package.rglob("*.py")), Path(sight.__file__)):
        code += path.read_bytes()
    return {
        "code": short_hash(code),
        "environment": str(ENVIRONMENT_VERSION),
        "torch": str(torch.__version__),
        "processor": processor_family(),
    }


@functools.cache
def file_hash(path: Path) -> str:
    """Return a hash of a file of weights, which must not change while the study runs."""
    return short_hash(path.read_bytes())


@functools.cache
def _detector_of(path: Path) -> str:
    """Return a hash of what the body of a file sees with; bodies of one training share it."""
    body = body_of(path)
    content = repr(body.object_classes).encode()
    for tensor in body.detector.state_dict().values():
        content += tensor.numpy().tobytes()
    return short_hash(content)


@functools.cache
def text_of(job: Job) -> str:
    """Return everything that is said, as a policy hears it."""
    return SpokenInstruction(instruct_job(job).turns, job.options.delivery).prompt


def show(work: str, done: int, total: int, note: str = "") -> None:
    """Print the end of a kind of work, each twentieth item, and whatever has a note."""
    if note or done == total or done % 20 == 0:
        print(f"{work}: {done:,} of {total:,} {note}", flush=True)
