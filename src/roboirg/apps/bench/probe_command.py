"""The process that runs a command and reports its own cost.

Imports nothing of the package: the command is found by its module's name.
"""

from __future__ import annotations

import contextlib
import io
import json
import pathlib
import resource
import runpy
import sys


def _main() -> None:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        runpy.run_module("roboirg", run_name="__main__", alter_sys=True)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    # The status file: `resource` may report the parent's memory from before the fork.
    status = pathlib.Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    costs = {
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "memory_gib": int(line.split()[1]) / 2**20,
    }
    sys.stdout.write(json.dumps(costs))


if __name__ == "__main__":
    _main()
