"""What the study trains, hears and plays, and what all that it stores depends on."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar
from urllib.parse import quote

import msgspec
import torch
from pydantic import BaseModel, BeforeValidator, Field

import roboirg_learn
from experiment.rewriting import KNOWN_WORDS, rewrite, text_of
from experiment.store import Key, Store
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.policy_ref import BEHIND, RESOLVE, PolicyRef, unknown_policy
from roboirg.core.versions import POLICY, Makeup
from roboirg.extension import sight
from roboirg.extension.episodes import goal_schema
from roboirg.language.settings import EXPLICIT
from roboirg.records.record import Job
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.episode_record import code_fingerprints
from roboirg.util.processor import processor_family
from roboirg.util.short_hash import short_hash
from roboirg_learn.policy.learned_policy import LearnedPolicy
from roboirg_learn.policy.policy_files import PolicyFiles
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
ReaderName = Annotated[str, Field(pattern="^(explicit|all|truth|resolve-.+)$")]


class Study(BaseModel, extra="forbid"):
    """What the study trains, hears and plays.

    Attributes:
        name: of its tables.
        memories: of bodies.
        seeds: of training.
        readers: named after the settings whose words they have learned; or `TRUTH`; or
            ``resolve-NAMER``: that of explicit words behind the rewriter ``resolve:NAMER``.
        tasks: names of tasks; they are learned and played.
        settings: of what is said, as in the plan of a run; so are the next six.
        scenes: in which bodies are trained, and readers; the next four are of `BodyPlan`.
        reader_epochs: of each reader.
        same_code: fingerprints of earlier code that was proven to play alike; its plays count.
        results: folder of what stays: weights, hearings, plays and tables.
        work: folder of what can be made again: recordings, checkpoints, first looks.
        workers: processes that record, draw and play.
        proven: share of the trials that a proof plays.
    """

    name: str
    memories: Several[Memory]
    seeds: Several[int]
    readers: Several[ReaderName]
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
    proven: float = 0.01

    def rows(self) -> list[Row]:
        """Return every body with every reader."""
        weights = self.results.resolve() / "weights"
        rows = []
        for memory in self.memories:
            for seed in self.seeds:
                for reader in self.readers:
                    rows.append(Row(memory, reader, seed, weights))
        return rows

    def plan(self) -> Plan:
        """Return a plan of all that is said, in which the oracle stands for the rows."""
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
        return make_plan("oracle", **self.model_dump(include=said, exclude_none=True))

    def trials(self) -> Iterator[Trial]:
        """Yield every row with every episode in all its words."""
        jobs = [msgspec.structs.replace(job, policy="", ref=None) for job in self.plan().jobs()]
        for row in self.rows():
            for job in jobs:
                yield Trial(row, job)

    @property
    def run(self) -> Path:
        """Folder with what is packed, like that of a run; proofs leave their actions there."""
        return self.work / "runs" / self.name

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
    def namer(self) -> str:
        """What names the goals for its rewriter, as in ``resolve:NAMER``; empty without one."""
        _, _, namer = self.heard.partition(f"{RESOLVE}-")
        return namer

    @property
    def ref(self) -> PolicyRef:
        """The policy in its records, with what all seeds share of it."""
        makeup: Makeup = ((POLICY, self.policy),)
        if self.namer:
            alone = f"{self.memory}-{EXPLICIT}"
            makeup = ((POLICY, f"{RESOLVE}:{self.namer}"), (BEHIND, alone))
        return replace(unknown_policy(self.policy), makeup=makeup)

    @property
    def spec(self) -> str:
        """How `roboirg run` names it; it is played with its seed, from which rules draw."""
        spec = PolicyFiles(self.body, self.reader).spec
        if not self.namer:
            return spec
        return f"{RESOLVE}:{self.namer}?policy={quote(spec)}&wordings={KNOWN_WORDS}"

    @property
    def body(self) -> Path:
        """File of the body."""
        return self.weights / f"{self.memory}-{self.seed}.body.safetensors"

    @property
    def reader(self) -> Path:
        """File of the reader; there is none for `TRUTH`."""
        words = EXPLICIT if self.namer else self.heard
        return self.weights / f"{words}-{self.seed}.reader.safetensors"


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
    def reported(self) -> dict[str, Any]:
        """What the row's reader hears, and how a rewriter understood it, as in `rewrite`."""
        if not self.row.namer:
            return {"heard": text_of(self.job)}
        return rewrite(self.row.namer, self.row.seed, self.job)

    @property
    def looks_name(self) -> str:
        """Of the file with the first looks: all that they depend on."""
        made_by = f"{detector_of(self.row.body)}-{circumstances()['code']}"
        return f"{made_by}/{self.episode.key.replace('/', '-')}.npz"

    @property
    def hearing_key(self) -> Key:
        """All that decides what the row's reader hears."""
        return {
            "reader": file_hash(self.row.reader),
            "detector": detector_of(self.row.body),
            "episode": self.episode.key,
            "text": short_hash(self.reported["heard"]),
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
def detector_of(path: Path) -> str:
    """Return a hash of what the body of a file sees with; bodies of one training share it."""
    body = body_of(path)
    content = repr(body.object_classes).encode()
    for tensor in body.detector.state_dict().values():
        content += tensor.numpy().tobytes()
    return short_hash(content)


def show(work: str, done: int, total: int, note: str = "") -> None:
    """Print the end of a kind of work, each twentieth item, and whatever has a note."""
    if note or done == total or done % 20 == 0:
        print(f"{work}: {done:,} of {total:,} {note}", flush=True)
