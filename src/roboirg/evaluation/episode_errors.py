"""Whose fault it is that an episode cannot be judged."""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from roboirg.core.errors import (
    InvalidActionError,
    MissingDependencyError,
    RenderDeviceError,
    RoboIRGError,
)
from roboirg.records.record import ErrorKind

ErrorSource = Literal["policy", "environment"]

MAX_CAUSE_LENGTH = 400


class EpisodeError(Exception):
    """Something other than the policy's skill ended the episode.

    Attributes:
        kind: whose fault it was.
        cause: the same with what happened, in one line.
        details: the traceback.
    """

    def __init__(self, kind: ErrorKind, what: str, details: str) -> None:
        super().__init__(what)
        self.kind = kind
        self.cause = format_cause(kind, what)
        self.details = details


def format_cause(kind: ErrorKind, what: str) -> str:
    """A record's cause: who is to blame, and for what."""
    return f"{kind.replace('_', ' ')}: {what}"


@contextmanager
def attribute_errors(whom: ErrorSource) -> Iterator[None]:
    """Turn what is raised inside into a fault.

    Raises:
        Fault: whatever was raised.
        RenderDeviceError: would end every other episode just the same, so the run stops.
        MissingDependencyError: likewise.
    """
    try:
        yield
    except (RenderDeviceError, MissingDependencyError, EpisodeError):
        raise
    except (Exception, SystemExit) as error:  # the boundary: anything is possible in there
        raise EpisodeError(_kind(whom, error), one_line(error), traceback.format_exc()) from error


def _kind(whom: ErrorSource, error: BaseException) -> ErrorKind:
    if isinstance(error, InvalidActionError):
        return "invalid_action"
    if whom == "policy":
        # A policy may be a client of something far away.
        if isinstance(error, TimeoutError):
            return "timeout"
        if isinstance(error, ConnectionError):
            return "connection"
    return whom


def one_line(error: BaseException) -> str:
    """An exception as one line that is the same in every process."""
    words = str(error) if isinstance(error, RoboIRGError) else f"{type(error).__name__}: {error}"
    words = re.sub(r"0x[0-9a-fA-F]{6,}", "0x…", " ".join(words.split())).rstrip(": ")
    return words.encode("utf-8", "replace").decode()[:MAX_CAUSE_LENGTH]
