"""The process whose startup or memory is measured; imports nothing that is not needed."""

from __future__ import annotations

import json
import pathlib
import sys
import time
from typing import Literal

from roboirg.envs.factory import make

Path = Literal["ours", "stock"]
TASK = "PickXtimes"


def observe(path: Path, index: int) -> None:
    """Play an episode without a video until its first observation."""
    if path == "ours":
        make(TASK, episode=index).reset()
        return
    from roboirg.core.observations import CAMERAS
    from roboirg.simulation.episode_session import EpisodeSession
    from roboirg.simulation.rendering.render_settings import STOCK
    from roboirg.tasks.splits.splits import get_episode

    session = EpisodeSession(get_episode(TASK, "test", index), visible=True, rendering=STOCK)
    session.play_demonstration()
    session.world.cameras.pictures(CAMERAS)
    for camera in CAMERAS:
        session.world.cameras.segmentation(camera)


def _peak_memory() -> float:
    """Return the peak resident memory of this process, GiB.

    Reads Linux's status file, because `resource` may report the parent's from before the fork.
    """
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 2**20


def _main(path: Path, what: str) -> None:
    results: dict[str, float] = {}
    start = time.perf_counter()
    observe(path, 0)
    if what == "next":
        if path == "ours":
            start = time.perf_counter()
            observe(path, 1)
        results["seconds"] = time.perf_counter() - start
    elif what == "memory":
        from roboirg.apps.bench import step_times
        from roboirg.apps.bench.workloads import over_the_table

        step_times.eager_step(over_the_table())
        results["gibibytes"] = _peak_memory()
    sys.stdout.write(json.dumps(results))


if __name__ == "__main__":
    _main("stock" if sys.argv[1] == "stock" else "ours", sys.argv[2])
