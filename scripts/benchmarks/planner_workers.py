"""Measure workers of a planner whose model takes its time: 16 against one.

python scripts/benchmarks/planner_workers.py PickXtimes BinFill

A stub model knows what the oracle says in each picture, and says it after two seconds. The rate is
of the episodes of one run, from the first beginning to the last end.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from datetime import datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

import roboirg
from roboirg.core.observations import FRONT, Observation
from roboirg.evaluation.records.store import read_records
from roboirg.policies import play
from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.hands.scripted_hands import ScriptedHands
from roboirg.policies.planners.hierarchical_policy import with_planner
from roboirg.policies.planners.oracle_planner import OraclePlanner

ANSWER_S = 2.0
EPISODES: Mapping[int, int] = {1: 3, 16: 48}
"""Episodes of a run, by its number of workers; each is played with two seeds of the policy."""


class _Notes(OraclePlanner):
    """The oracle, which notes what it says in which picture, in a model's coordinates."""

    def __init__(self, answers: dict[str, str]) -> None:
        super().__init__()
        self._answers = answers

    def plan(self, observation: Observation, step: int) -> str | None:
        subgoal = super().plan(observation, step)
        said = re.sub(r"\d+(?=[,>])", _to_model, str(subgoal))
        self._answers.setdefault(_digest(self.env.picture(FRONT)), said)
        return subgoal


def _to_model(pixel: re.Match[str]) -> str:
    return f"{(int(pixel[0]) + 0.5) / 0.256:.0f}"


def _digest(picture: np.ndarray[Any, Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(picture).tobytes()).hexdigest()


def oracle_answers(task: str, episodes: int) -> dict[str, str]:
    """Return what the oracle says, by the digest of the front picture."""
    answers: dict[str, str] = {}
    for episode in range(episodes):
        policy = with_planner(_Notes(answers), ScriptedHands())
        needs = PolicyNeeds.of(policy).env_options | {"cameras": (FRONT,)}
        env = roboirg.make(task, episode=episode, **needs)
        play(env, policy)
        answers[_digest(env.picture(FRONT))] = "done"
        env.close()
    return answers


@contextlib.contextmanager
def stub_model(answers: Mapping[str, str]) -> Iterator[tuple[str, list[str]]]:
    """Serve a model with OpenAI's API; yields its address, and digests that it did not know."""
    unknown: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_args: object) -> None:
            pass

        def do_POST(self) -> None:
            end = time.monotonic() + ANSWER_S
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            *_, last = re.finditer(r'data:image/png;base64,([^"]+)', body)
            file = np.frombuffer(base64.b64decode(last[1]), np.uint8)
            seen = _digest(np.asarray(cv2.imdecode(file, cv2.IMREAD_COLOR))[..., ::-1])
            if seen not in answers:
                unknown.append(seen)
            message = {"role": "assistant", "content": answers.get(seen, "done")}
            choice = {"index": 0, "message": message, "finish_reason": "stop"}
            reply = {"id": "1", "object": "chat.completion", "created": 0, "model": "stub"}
            sent = json.dumps(reply | {"choices": [choice]}).encode()
            time.sleep(max(end - time.monotonic(), 0.0))
            self.send_response(200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(sent)))
            self.end_headers()
            self.wfile.write(sent)

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/v1", unknown
    server.shutdown()


class Rate(NamedTuple):
    """Episodes an hour, share of successes, and seconds of the processor for an episode."""

    an_hour: float
    successes: float
    processor_s: float


def rate(task: str, address: str, workers: int) -> Rate:
    """Play a run and return its rate."""
    with tempfile.TemporaryDirectory() as folder:
        words = [
            *("--policy", f"planner:stateless?base_url={address}&model=stub"),
            *("--tasks", task, "--settings", "explicit", "--episodes", str(EPISODES[workers])),
            *("--policy-seeds", "0,1"),
            *("--workers", str(workers), "--out", folder),
        ]
        command = [sys.executable, "-m", "roboirg", "run", *words]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - our own
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        records = list(read_records(Path(folder)))
    starts = [datetime.fromisoformat(one.started_at).timestamp() for one in records]
    ends = [start + one.duration_s for start, one in zip(starts, records, strict=True)]
    successes = sum(one.outcome == "success" for one in records)
    spent = sum(after[:2]) - sum(before[:2])
    count = len(records)
    return Rate(3600 * count / (max(ends) - min(starts)), successes / count, spent / count)


def main() -> None:
    """Print a line for each task of the command line."""
    for task in sys.argv[1:]:
        load = os.getloadavg()[1]
        with stub_model(oracle_answers(task, max(EPISODES.values()))) as (address, unknown):
            found = {workers: rate(task, address, workers) for workers in EPISODES}
        many, one = found[16], found[1]
        cores = (os.cpu_count() or 1) * 3600 / many.processor_s
        print(
            f"{task}: {many.an_hour:.0f} episodes an hour, {many.an_hour / one.an_hour:.1f} × one"
        )
        print(f"worker ({one.an_hour:.0f}); cores allow {cores:.0f}, {many.an_hour / cores:.0%};")
        print(f"{many.successes:.0%} succeed, {len(unknown)} unknown pictures; load {load:.1f}")


if __name__ == "__main__":
    main()
