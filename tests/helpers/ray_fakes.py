"""Ways to play and policies that fail on one machine of a cluster: where `BAD_MACHINE` is set."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from run_fakes import FakePlayer

from roboirg.core.errors import RenderDeviceError
from roboirg.records.record import Job, Record

BAD_MACHINE = "BAD_MACHINE"


class WithoutVulkan(FakePlayer):
    """Finds no Vulkan device on the bad machine."""

    def __call__(self, job: Job) -> Record:
        if os.environ.get(BAD_MACHINE):
            raise RenderDeviceError("No Vulkan device can render; install one.")
        return super().__call__(job)


class WithoutModule(FakePlayer):
    """Cannot be loaded on the bad machine."""

    def __reduce__(self) -> tuple[Callable[..., WithoutModule], tuple[object, ...]]:
        return load, (self.folder, self.seconds, self.fatal, self.gate, self.closed)


def load(*fields: Any) -> WithoutModule:
    """Load what plays."""
    if os.environ.get(BAD_MACHINE):
        raise ModuleNotFoundError("No module named 'needed_here'")
    return WithoutModule(*fields)


class NotingPlace(FakePlayer):
    """Writes in each video where it was played: a variable, a file of the working folder."""

    def __call__(self, job: Job) -> Record:
        record = super().__call__(job)
        found = (os.environ.get("A_KEY", ""), Path("note.txt").read_text(), os.environ["RACK"])
        (self.folder / str(record.video)).write_text(" ".join(found))
        return record
