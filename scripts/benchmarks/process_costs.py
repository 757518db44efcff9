"""Startup, processor time and peak memory of processes of our own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from roboirg.apps.bench import start_times

_PROBE = Path(__file__).with_name("probe.py")


def next_episode(path: start_times.Path) -> float:
    """Return seconds for another episode without a video in the same process.

    On the stock path it costs as much as the first one after the imports: SAPIEN frees its render
    engine with the last scene, so a new environment creates it again.
    """
    return probe("next", path)["seconds"]


def process_memory() -> float:
    """Return the peak memory of a process that plays and draws both cameras, GiB."""
    return probe("memory")["memory_gib"]


def probe(*words: str) -> dict[str, float]:
    """Return what the probe's process reports of itself."""
    done = subprocess.run(  # noqa: S603 - our own command
        [sys.executable, str(_PROBE), *words],
        check=True,
        capture_output=True,
        text=True,
        env=start_times.installed_environment(),
    )
    results: dict[str, float] = json.loads(done.stdout)
    return results
