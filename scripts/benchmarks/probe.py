"""The process that reports its own costs as JSON.

It imports nothing that is not needed: the module of a command is found by its name.
"""

from __future__ import annotations

import contextlib
import io
import json
import pathlib
import resource
import runpy
import sys
import time

TASK = "PickXtimes"


def _observe(path: str, index: int) -> None:
    """Play an episode without a video until its first observation."""
    if path == "ours":
        from roboirg.envs.factory import make

        make(TASK, episode=index).reset()
        return
    from benchmarks.step_times import draw_as_stock
    from roboirg.simulation.episode_session import EpisodeSession
    from roboirg.simulation.rendering.render_settings import STOCK
    from roboirg.tasks.splits.splits import get_episode

    session = EpisodeSession(get_episode(TASK, "test", index), visible=True, rendering=STOCK)
    session.play_demonstration()
    draw_as_stock(session.world.cameras)


def _next_episode(path: str) -> dict[str, float]:
    """Return seconds to the first observation of an episode after another one."""
    start = time.perf_counter()
    _observe(path, 0)
    if path == "ours":
        start = time.perf_counter()
        _observe(path, 1)
    return {"seconds": time.perf_counter() - start}


def _memory() -> dict[str, float]:
    """Return the peak memory of playing and drawing."""
    from benchmarks.step_times import eager_step, over_the_table

    _observe("ours", 0)
    eager_step(over_the_table())
    return {"memory_gib": _peak_memory()}


def _command(words: list[str]) -> dict[str, float]:
    """Return processor time and peak memory of a command of `roboirg`."""
    sys.argv = ["roboirg", *words]
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            runpy.run_module("roboirg", run_name="__main__", alter_sys=True)
        except SystemExit as ending:
            if ending.code:  # what fails early costs little
                raise
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {"cpu_s": usage.ru_utime + usage.ru_stime, "memory_gib": _peak_memory()}


def _peak_memory() -> float:
    """Return the peak resident memory of this process, GiB.

    Reads Linux's status file, because `resource` may report the parent's from before the fork.
    """
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 2**20


if __name__ == "__main__":
    what, *words = sys.argv[1:]
    found: dict[str, float] = {}
    if what == "first":
        _observe(words[0], 0)
    elif what == "next":
        found = _next_episode(words[0])
    elif what == "memory":
        found = _memory()
    else:
        found = _command(words)
    sys.stdout.write(json.dumps(found))
