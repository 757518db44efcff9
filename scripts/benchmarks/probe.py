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


def _next_episode(path: str) -> dict[str, float]:
    """Return seconds to the first observation of an episode after another one."""
    from roboirg.apps.bench.start_times import observe

    start = time.perf_counter()
    if path == "ours":
        observe("ours", 0)
        start = time.perf_counter()
        observe("ours", 1)
    else:
        observe("stock", 0)
    return {"seconds": time.perf_counter() - start}


def _memory() -> dict[str, float]:
    """Return the peak memory of playing and drawing."""
    from roboirg.apps.bench.start_times import observe
    from roboirg.apps.bench.step_times import eager_step, over_the_table

    observe("ours", 0)
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
    found = (
        _command(words) if what == "command" else _memory() if what == "memory"
        else _next_episode(*words)
    )  # fmt: skip
    sys.stdout.write(json.dumps(found))
