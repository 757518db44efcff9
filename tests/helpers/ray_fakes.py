"""Ways to play and policies that fail on one machine of a cluster, and a run in a thread.

The machine is the one where the variable `BAD_MACHINE` is set.
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from run_fakes import FakePlayer

from roboirg.core.errors import RenderDeviceError
from roboirg.runs.run.runner import run_plan

BAD_MACHINE = "BAD_MACHINE"


class WithoutVulkan(FakePlayer):
    """Finds no Vulkan device on the bad machine."""

    def __call__(self, job):
        if os.environ.get(BAD_MACHINE):
            raise RenderDeviceError("No Vulkan device can render; install one.")
        return super().__call__(job)


class WithoutModule(FakePlayer):
    """Cannot be loaded on the bad machine."""

    def __reduce__(self):
        return load, (self.folder, self.seconds, self.fatal, self.gate, self.closed)


def load(*fields):
    """Load what plays."""
    if os.environ.get(BAD_MACHINE):
        raise ModuleNotFoundError("No module named 'needed_here'")
    return WithoutModule(*fields)


class NotingPlace(FakePlayer):
    """Writes in each video where it was played: a variable, a file of the working folder."""

    def __call__(self, job):
        record = super().__call__(job)
        found = (os.environ.get("A_KEY", ""), Path("note.txt").read_text(), os.environ["RACK"])
        (self.folder / str(record.video)).write_text(" ".join(found))
        return record


def start_run(*arguments, **options):
    """Start `run_plan` with these arguments in a thread; return what will be its summary."""
    return ThreadPoolExecutor().submit(run_plan, *arguments, **options)


def wait_until(is_so, run=None):
    """Wait until something is so, for five minutes at most, or until a run has ended with or
    without it."""
    deadline = time.monotonic() + 300
    while not is_so() and not (run and run.done()):
        assert time.monotonic() < deadline, "it takes too long"
        time.sleep(0.05)
