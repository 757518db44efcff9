"""Errors that end an episode without a verdict, and what caused them."""

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
from roboirg.core.printable import printable
from roboirg.records.record import ErrorKind

ErrorSource = Literal["policy", "environment"]

MAX_CAUSE_LENGTH = 400


class EpisodeError(Exception):
    """An error ended the episode before it could be judged.

    Attributes:
        kind: kind of error.
        cause: kind and message in one line.
        details: the traceback.
    """

    def __init__(self, kind: ErrorKind, message: str, details: str) -> None:
        super().__init__(message)
        self.kind = kind
        # A server may have chosen the words, and both are printed.
        self.cause = format_cause(kind, printable(message))
        self.details = printable(details)


def format_cause(kind: ErrorKind, message: str) -> str:
    """Return a record's cause: kind of error and message."""
    return f"{kind.replace('_', ' ')}: {message}"


@contextmanager
def attribute_errors(source: ErrorSource) -> Iterator[None]:
    """Turn every exception raised inside into an `EpisodeError` of this source.

    Raises:
        EpisodeError: an exception was raised.
        RenderDeviceError: unchanged, because every other episode would end the same way.
        MissingDependencyError: likewise.
    """
    try:
        yield
    except (RenderDeviceError, MissingDependencyError, EpisodeError):
        raise
    except (Exception, SystemExit) as error:  # policies and simulators may raise anything
        kind = _error_kind(source, error)
        raise EpisodeError(kind, one_line(error), traceback.format_exc()) from error


def _error_kind(source: ErrorSource, error: BaseException) -> ErrorKind:
    if isinstance(error, InvalidActionError):
        return "invalid_action"
    if source == "policy":
        # A policy may be the client of a remote server.
        if isinstance(error, TimeoutError):
            return "timeout"
        if isinstance(error, ConnectionError):
            return "connection"
    return source


def one_line(error: BaseException) -> str:
    """Return an exception as one line that is the same in every process."""
    words = str(error) if isinstance(error, RoboIRGError) else f"{type(error).__name__}: {error}"
    words = re.sub(r"0x[0-9a-fA-F]{6,}", "0x…", " ".join(words.split())).rstrip(": ")
    return words.encode("utf-8", "replace").decode()[:MAX_CAUSE_LENGTH]
