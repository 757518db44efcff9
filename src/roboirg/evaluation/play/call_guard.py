"""Calls of a policy and of an environment: whose error it is, how long it took, what watches it."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Iterator

from roboirg.core.errors import EndOfRunError
from roboirg.core.waiting import queued_seconds
from roboirg.evaluation.episode_errors import (
    EpisodeError,
    EpisodeLostError,
    ErrorSource,
    Terminated,
    describe_error,
)
from roboirg.evaluation.play.watchdog import Phase, watched


class CallGuard:
    """Attributes errors of policy and environment calls, watches their time and measures it.

    Args:
        timings: gets the seconds, by name.
        policy_timeout_s: seconds that one call of the policy may take; None for no limit.
        is_hosted: whether the policy's host watches the time instead.
    """

    def __init__(
        self,
        timings: dict[str, float],
        policy_timeout_s: float | None,
        *,
        is_hosted: bool = False,
    ) -> None:
        self._timings, self._limit_s, self._is_hosted = timings, policy_timeout_s, is_hosted

    @contextlib.contextmanager
    def policy(self, phase: Phase, name: str) -> Iterator[None]:
        """Guard a call of the policy, whose time is added to the timing of that name."""
        # Whatever ends this process while it waits for a host, it is not the policy.
        hosted: Phase = "wait for the policy's host"
        watching = watched(hosted) if self._is_hosted else watched(phase, self._limit_s)
        with attribute_errors("policy"), watching, self._timed(name):
            yield

    @contextlib.contextmanager
    def environment(self, name: str) -> Iterator[None]:
        """Guard a call of the environment, likewise."""
        with attribute_errors("environment"), watched("environment"), self._timed(name):
            yield

    @contextlib.contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        start, queued = time.perf_counter(), queued_seconds()
        try:
            yield
        finally:
            # Waiting for one's turn is not thinking.
            queued = queued_seconds() - queued
            self._add(name, time.perf_counter() - start - queued)
            if queued:
                self._add("policy_queue", queued)

    def _add(self, name: str, seconds: float) -> None:
        self._timings[name] = round(self._timings.get(name, 0.0) + seconds, 6)


@contextlib.contextmanager
def attribute_errors(source: ErrorSource) -> Iterator[None]:
    """Turn every exception raised inside into an `EpisodeError` of this source.

    Raises:
        EpisodeError: an exception was raised.
        EpisodeLostError: unchanged, because the episode is played again.
        EndOfRunError: unchanged, because every other episode would end the same way.
        KeyboardInterrupt: unchanged, if it may be the user's.
    """
    try:
        yield
    except (EndOfRunError, EpisodeError, EpisodeLostError, Terminated):
        raise
    except (Exception, SystemExit, GeneratorExit, KeyboardInterrupt) as error:
        # Policies may raise anything. Where Ctrl-C is ignored, as in workers, it is not the user's.
        if isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is not (
            signal.SIG_IGN
        ):
            raise
        raise describe_error(source, error) from error
