"""What a process does of which the start or the memory is measured; it imports nothing else."""

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
    """Play an episode without a video up to its first observation."""
    if path == "ours":
        make(TASK, episode=index).reset()
        return
    from roboirg.core.observations import CAMERAS
    from roboirg.episodes.splits import get_episode
    from roboirg.simulation.episode_session import EpisodeSession
    from roboirg.simulation.rendering.render_settings import STOCK

    session = EpisodeSession(get_episode(TASK, "test", index), visible=True, rendering=STOCK)
    session.play_demonstration()
    session.world.cameras.pictures(CAMERAS)
    for camera in CAMERAS:
        session.world.cameras.segmentation(camera)


def _most_resident() -> float:
    """The most memory that this process has held, GiB.

    From Linux's status file: what `resource` tells may be the parent's before the fork.
    """
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 2**20


def _main(path: Path, what: str) -> None:
    told: dict[str, float] = {}
    start = time.perf_counter()
    observe(path, 0)
    if what == "next":
        if path == "ours":
            start = time.perf_counter()
            observe(path, 1)
        told["seconds"] = time.perf_counter() - start
    elif what == "memory":
        from roboirg.perf import step_times
        from roboirg.perf.workloads import over_the_table

        step_times.eager_step(over_the_table())
        told["gibibytes"] = _most_resident()
    sys.stdout.write(json.dumps(told))


if __name__ == "__main__":
    _main("stock" if sys.argv[1] == "stock" else "ours", sys.argv[2])
