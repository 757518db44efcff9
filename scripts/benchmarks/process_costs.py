"""Startup, processor time and peak memory of processes of our own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Literal

Way = Literal["ours", "stock"]


def process_start(way: Way) -> float:
    """Return seconds from the start of a process to its first observation."""
    start = time.perf_counter()
    probe("first", way)
    return time.perf_counter() - start


def next_episode(way: Way) -> float:
    """Return seconds for another episode without a video in the same process.

    On the stock path it costs as much as the first one after the imports: SAPIEN frees its render
    engine with the last scene, so a new environment creates it again.
    """
    return probe("next", way)["seconds"]


def process_memory() -> float:
    """Return the peak memory of a process that plays and draws both cameras, GiB."""
    return probe("memory")["memory_gib"]


def probe(*words: str) -> dict[str, float]:
    """Return what the probe's process reports of itself."""
    # Bytecode is cached, as for an installed package.
    variables = dict(os.environ)
    variables.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(  # noqa: S603 - our own command
        [sys.executable, "-m", "benchmarks.probe", *words],
        check=True,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[1],
        env=variables,
    )
    results: dict[str, float] = json.loads(done.stdout)
    return results
