"""Starts commands of the kit in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
CLI = "import sys; from roboirg.cli.real_commands import real_app; real_app(sys.argv[1:])"

STARTED = []


def start(*words, **options):
    """A command of ``roboirg real`` in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(HERE), "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(
        [sys.executable, "-c", CLI, *map(str, words)],
        env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options,
    )  # fmt: skip
    STARTED.append(process)
    return process


def end_all():
    """No process outlives its test, even one that fails."""
    while STARTED:
        process = STARTED.pop()
        process.kill()
        process.wait(timeout=30)
