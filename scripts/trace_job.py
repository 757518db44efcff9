"""Follow one job through the rooms of the package, from the plan's queue to its stored record.

python scripts/trace_job.py [own|shared]  # where the policy runs; default: own

A world of paper is played. A first job fills the caches; the second is followed:

- A room is one of tests/ceilings.toml. `core` and `util`, which almost every room imports, are
  left out.
- A job enters a room when a function of another room calls one of it. When the same function calls
  the same one again, as in a loop, this is no new entry, and neither is a return.
- Entries into one room in a row are one stay.
- A stay is a climb if its room is above that of the stay before and the job was there already, so
  that a room is asked again. A room is above all that it imports, directly or through others.
- What the caller's file imports nothing of was handed to it, such as a policy object or a method
  that a subclass replaces. Such a stay is marked, and is no climb.
"""

from __future__ import annotations

import functools
import sys
import tempfile
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NamedTuple
from unittest import mock

import layout
import numpy as np
from numpy.typing import NDArray

from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.plan_sections import Hosting, PolicyProcessMode
from roboirg.evaluation.play import rollout
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.rollout import PlayJob
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.run.executor import InProcess, Records, Warn
from roboirg.evaluation.run.progress import Reporter
from roboirg.evaluation.run.runner import episode_runner, run_plan
from roboirg.policies.by_name.finding import read_policy

DIVIDED = {"apps", "evaluation", "policies"}
"""Folders whose folders are rooms."""
LEFT_OUT = ("core", "util")


class PaperWorld:
    """A world in which one answer succeeds; needs no simulator."""

    render_device = "none"
    executed_actions = 0

    def __init__(self, prepared: PreparedJob, _needs: object) -> None:
        self.instruction = prepared.words.instruction
        self.seen = {"front_rgb": np.zeros((256, 256, 3), np.uint8), "joint_positions": np.zeros(7)}
        self.info = {"status": "ongoing", "events": [], "heard": [], "elapsed_steps": 3}

    def reset(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the first observation."""
        video = {"joint_positions": np.zeros((3, 7))}
        return self.seen, {**self.info, "demonstration": video, "demonstration_source": "planned"}

    def step_chunk(self, rows: NDArray[Any]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Execute an answer."""
        self.executed_actions += len(rows)
        event = {"step": 3 + len(rows), "kind": "picked", "subject": "cube", "place": None}
        info = {**self.info, "status": "success", "steps": len(rows), "events": [event]}
        return self.seen, 0.0, True, False, info

    def end_state(self) -> tuple[NDArray[Any], str]:
        """Return the last state."""
        return np.zeros(3), "paper"

    def close(self) -> None:
        """Have nothing to close."""


class Stay(NamedTuple):
    """Entries into one room in a row.

    Attributes:
        room: the room.
        kind: ``climb``, ``handed``, or empty for one that is neither.
        entries: the functions that were called, each with its caller.
    """

    room: str
    kind: str
    entries: list[str]


class Follower(Reporter):
    """Plays jobs in this process, and notes the calls of the one after the first.

    Attributes:
        calls: the called function of each entry with its caller.
    """

    def __init__(self) -> None:
        self.calls: dict[tuple[CodeType, CodeType], None] = {}
        self._played = 0

    def run(self, jobs: deque[Job], play: PlayJob, warn: Warn, /) -> Records:
        """Yield one record for each job."""
        records = InProcess().run(jobs, play, warn)
        while jobs:
            if self._played:
                sys.setprofile(self._note)
            yield next(records)

    def advance(self, record: Record, *, is_new: bool = True) -> None:
        """Follow the job no more: its record is stored."""
        sys.setprofile(None)
        if record.outcome != "success" or not is_new:
            raise AssertionError(f"the job was not played: {record.cause}")
        self._played += 1

    def _note(self, frame: FrameType, event: str, _argument: object) -> None:
        room, caller = room_of(frame.f_code), frame.f_back
        while caller is not None and room_of(caller.f_code) is None:
            caller = caller.f_back
        if caller and event == "call" and room_of(caller.f_code) != room and room is not None:
            self.calls[frame.f_code, caller.f_code] = None


@functools.cache
def room_of(code: CodeType | Path) -> str | None:
    """Return the room of a function or file; None for those that are not followed."""
    path = code if isinstance(code, Path) else Path(code.co_filename)
    if not path.is_relative_to(layout.PACKAGE):
        return None
    folders = path.relative_to(layout.PACKAGE).parts[:-1]
    room = "/".join(folders[: 2 if set(folders) & DIVIDED else 1])
    return None if room in LEFT_OUT else room


def floors() -> Mapping[str, int]:
    """Return the floor of each room: above all that it imports."""
    graph: defaultdict[str, set[str]] = defaultdict(set)
    for one in layout.imports():
        source, target = (str(room_of(layout.modules()[name])) for name in one)
        graph[source] |= {target} - {source}
    return layout.floors(dict(graph))


def stays(calls: Iterable[tuple[CodeType, CodeType]]) -> list[Stay]:
    """Return the stays of a job, in order."""
    found: list[Stay] = []
    height, seen = floors(), set[str]()
    imported = {
        (str(layout.modules()[source]), room_of(layout.modules()[target]))
        for source, target in layout.imports()
    }
    for called, caller in calls:
        room = str(room_of(called))
        functions = [f"{Path(one.co_filename).stem}.{one.co_qualname}" for one in (called, caller)]
        if not found or room != found[-1].room:
            is_above = room in seen and height[room] > height[found[-1].room]
            is_known = (caller.co_filename, room) in imported
            found.append(Stay(room, ("climb" if is_above else "") if is_known else "handed", []))
        found[-1].entries.append(" <- ".join(functions))
        seen.add(room)
    return found


def follow(policy_process: PolicyProcessMode = "own") -> list[Stay]:
    """Play two jobs, and return the stays of the second."""
    plan = Plan(
        policies=(read_policy("benchmarks.worker_rates:WavingPolicy"),),
        tasks=("PickXtimes",),
        settings=("direct",),
        episodes=(0, 1),
        hosting=Hosting(policy_process=policy_process),
    )
    follower = Follower()
    with tempfile.TemporaryDirectory() as name, mock.patch.object(rollout, "make_env", PaperWorld):
        play = episode_runner(plan, Path(name))
        run_plan(plan, play.folder, play, follower, reporter=follower)
    return stays(follower.calls)


if __name__ == "__main__":
    found = follow("shared" if "shared" in sys.argv else "own")
    for number, stay in enumerate(found, 1):
        print(f"{number:3} {stay.room:24} {stay.kind:8} {', '.join(stay.entries)}")
    kinds, rooms = Counter(stay.kind for stay in found), {stay.room for stay in found}
    print(
        f"{len(found)} stays in {len(rooms)} rooms, {kinds['climb']} climbs; "
        f"{kinds['handed']} were handed"
    )
