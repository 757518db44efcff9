"""Cost of commands that read a run of 50,000 records.

Processor time of the process, in user and in kernel mode, which depends less than wall-clock time
on what else the machine does. Each command is run once, whatever the number of rounds.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Literal

from benchmarks.engine_costs import temporary_folder
from benchmarks.process_costs import probe
from benchmarks.synthetic_run import write_synthetic_run

RECORDS = 50_000

Command = Literal["tables", "records merge", "report"]


def command_time(command: Command) -> float:
    """Return the processor time of a command, seconds."""
    return _costs(command)["cpu_s"]


def command_memory(command: Command) -> float:
    """Return the peak memory of a command, GiB."""
    return _costs(command)["memory_gib"]


@functools.cache
def _costs(command: Command) -> dict[str, float]:
    folder = _synthetic_run()
    out = ["--out", str(folder.with_name("merged"))] if command == "records merge" else []
    return probe("command", *command.split(), str(folder), *out)


@functools.cache
def _synthetic_run() -> Path:
    folder = temporary_folder() / "run"
    write_synthetic_run(folder, RECORDS)
    return folder
