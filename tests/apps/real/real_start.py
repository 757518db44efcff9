"""Start ``roboirg real`` in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
CLI = "import sys; from roboirg.apps.real.commands import real_app; real_app(sys.argv[1:])"

STARTED = []


def start(*words, **options):
    """Start a command of ``roboirg real`` in a process of its own."""
    paths = filter(None, (str(HERE), os.environ.get("PYTHONPATH")))
    environment = {
        **os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1",
    }  # fmt: skip
    process = subprocess.Popen(
        [sys.executable, "-c", CLI, *map(str, words)],
        env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options,
    )  # fmt: skip
    STARTED.append(process)
    return process


def end_all():
    """Kill all processes that a test started."""
    while STARTED:
        process = STARTED.pop()
        process.kill()
        process.wait(timeout=600)
