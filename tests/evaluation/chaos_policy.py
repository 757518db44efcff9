"""A policy that misbehaves in some of its episodes, in every known way."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

EVERY = 3
"""Every third episode goes wrong."""

KINDS = {
    "raise": "policy",
    "exit": "policy",
    "die": "policy",
    "crash": "policy",
    "killed": "infrastructure",
    "hang": "timeout",
    "hang in native code": "timeout",
    "hang in reset": "timeout",
    "nan": "invalid_action",
    "shape": "invalid_action",
    "words": "invalid_action",
    "nothing": "invalid_action",
    "too much": "invalid_action",
    "wordy": "policy",
    "timeout": "timeout",
    "unconnected": "connection",
}
"""What it does, and the kind of error that this is."""

CALM = "ROBOIRG_TEST_CALM"
"""Environment variable that makes it behave in every episode."""


def misdeed(seed: int) -> str | None:
    """What it does in the episode with this policy seed."""
    return None if seed % EVERY else [*KINDS][seed // EVERY % len(KINDS)]


class ChaosPolicy:
    cameras: ClassVar[tuple[str, ...]] = ()
    version = "1"

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed
        self.misdeed = None if os.environ.get(CALM) else misdeed(seed)
        self.metadata: dict[str, Any] = {"seed": seed}
        self.calls = 0

    def reset(self, instruction: str, demonstration: Any) -> None:
        if self.misdeed == "hang in reset":
            time.sleep(3600)
        if self.misdeed == "wordy":
            self.metadata = {"words": "x" * 1_000_000}

    def act(self, observation: Any) -> Any:
        self.calls += 1
        rows = np.tile(np.append(observation["joint_positions"], 1.0), (5, 1))
        if self.calls == 2 and self.misdeed is not None:
            return self.misbehave(rows)
        return rows

    def misbehave(self, rows: np.ndarray) -> Any:  # noqa: C901, PLR0912 - one way each
        match self.misdeed:
            case "raise":
                raise ValueError("no more")
            case "exit":
                sys.exit(0)
            case "die":
                os._exit(0)
            case "crash":
                ctypes.string_at(0)
            case "killed":
                os.kill(os.getpid(), signal.SIGKILL)
            case "hang":
                while True:
                    time.sleep(0.01)
            case "hang in native code":
                # Holds the interpreter's lock for ever, so that no thread can do anything.
                ctypes.PyDLL(None).sleep(3600)
            case "nan":
                return rows * np.nan
            case "shape":
                return rows[:, :3]
            case "words":
                return "left"
            case "nothing":
                return None
            case "too much":
                return np.zeros((200_000, 8))
            case "timeout":
                raise TimeoutError("the server is slow")
            case "unconnected":
                raise ConnectionResetError("the server went away")
        return rows

    def usage(self) -> dict[str, float]:
        return {"calls": self.calls}


SPEC = f"{Path(__file__).stem}:ChaosPolicy"
