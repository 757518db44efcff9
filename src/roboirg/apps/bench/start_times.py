"""Time from the start of a process to its first observation.

Executed as a module, it is that process, and imports nothing that is not needed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import Literal

TASK = "PickXtimes"
Path = Literal["ours", "stock"]


def process_start(path: Path) -> float:
    """Return seconds from the start of a process to its first observation."""
    start = time.perf_counter()
    subprocess.run(  # noqa: S603 - our own command
        [sys.executable, "-m", __name__, path],
        check=True,
        capture_output=True,
        env=installed_environment(),
    )
    return time.perf_counter() - start


def installed_environment() -> dict[str, str]:
    """Return environment variables with which bytecode is cached, as for an installed package."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def observe(path: Path, index: int) -> None:
    """Play an episode without a video until its first observation."""
    if path == "ours":
        from roboirg.envs.factory import make

        make(TASK, episode=index).reset()
        return
    from roboirg.apps.bench.step_times import draw_as_stock
    from roboirg.simulation.episode_session import EpisodeSession
    from roboirg.simulation.rendering.render_settings import STOCK
    from roboirg.tasks.splits.splits import get_episode

    session = EpisodeSession(get_episode(TASK, "test", index), visible=True, rendering=STOCK)
    session.play_demonstration()
    draw_as_stock(session.world.cameras)


if __name__ == "__main__":
    observe("stock" if sys.argv[1] == "stock" else "ours", 0)
