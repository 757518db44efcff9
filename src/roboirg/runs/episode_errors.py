"""Errors that end an episode without a verdict, and what caused them."""

from __future__ import annotations

import traceback
from typing import Literal

from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidActionError
from roboirg.core.plain_text import clip_text, printable
from roboirg.records.record import ErrorKind

ErrorSource = Literal["policy", "environment"]

MAX_DETAILS_LENGTH = 20_000
"""Most characters of a traceback; its end is kept."""


class Terminated(KeyboardInterrupt):
    """The process received SIGTERM; handled like Ctrl-C, and never a policy's own."""


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


class EpisodeLostError(Exception):
    """The policy's process was lost through no fault of this episode, which is played again.

    Attributes:
        kind: kind of error, if it is lost again and again.
        alone: whether the policy must be asked about this episode alone from now on.
    """

    def __init__(self, kind: ErrorKind, message: str, *, alone: bool = False) -> None:
        super().__init__(message)
        self.kind = kind
        self.alone = alone


def format_cause(kind: ErrorKind, message: str) -> str:
    """Return a record's cause: kind of error and message."""
    return f"{kind.replace('_', ' ')}: {message}"


def describe_error(source: ErrorSource, error: BaseException) -> EpisodeError:
    """Return the `EpisodeError` of an exception that is being handled."""
    trace = traceback.format_exc()[-MAX_DETAILS_LENGTH:]
    kind = _error_kind(source, error)
    return EpisodeError(kind, one_line(error), clip_text(trace, MAX_DETAILS_LENGTH))


def _error_kind(source: ErrorSource, error: BaseException) -> ErrorKind:
    """Return the kind of error that a record gets for an exception: ``timeout``, ``policy``, ….

    A policy may be the client of a server, so its time-outs and lost connections have kinds of
    their own. For all other exceptions the kind is `source`, where they were raised.
    """
    if isinstance(error, InvalidActionError):
        return "invalid_action"
    if source == "policy" and isinstance(error, TimeoutError):
        return "timeout"
    if source == "policy" and isinstance(error, ConnectionError):
        return "connection"
    return source
