"""Cost of commands that read a run of 50,000 records.

Processor time of the process, in user and in kernel mode, which depends less than wall-clock time
on what else the machine does. Each command is run once, whatever the number of rounds.
"""

from __future__ import annotations

import atexit
import functools
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Literal

from roboirg.apps.bench.synthetic_run import write_synthetic_run

RECORDS = 50_000

Command = Literal["tables", "merge", "report"]


def command_time(command: Command) -> float:
    """Return the processor time of a command, seconds."""
    return _costs(command)["cpu_s"]


def command_memory(command: Command) -> float:
    """Return the peak memory of a command, GiB."""
    return _costs(command)["memory_gib"]


@functools.cache
def _costs(command: Command) -> dict[str, float]:
    folder = _synthetic_run()
    arguments = ["--out", str(folder.with_name("merged"))] if command == "merge" else []
    done = subprocess.run(  # noqa: S603
        [
            sys.executable,
            "-m",
            "roboirg.apps.bench.probe_command",
            command,
            str(folder),
            *arguments,
        ],
        check=True,
        capture_output=True,
        text=True,
    )
    costs: dict[str, float] = json.loads(done.stdout)
    return costs


@functools.cache
def _synthetic_run() -> Path:
    parent = Path(tempfile.mkdtemp(prefix="roboirg-bench-"))
    atexit.register(shutil.rmtree, parent, ignore_errors=True)
    write_synthetic_run(parent / "run", RECORDS)
    return parent / "run"
