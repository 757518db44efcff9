"""Calls of a policy and of an environment: whose error it is, how long it took, what watches it."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Iterator

from roboirg.core.errors import EndOfRunError
from roboirg.core.waiting import queued_seconds
from roboirg.runs.episode_errors import (
    EpisodeError,
    EpisodeLostError,
    ErrorSource,
    Terminated,
    describe_error,
)
from roboirg.runs.play.watchdog import Phase, watched


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
        self._timings = timings
        self._limit_s = policy_timeout_s
        self._is_hosted = is_hosted

    @contextlib.contextmanager
    def policy(self, phase: Phase, name: str) -> Iterator[None]:
        """Guard a call of the policy: attribute its errors, limit its time, and measure it.

        Args:
            phase: what the watchdog is to show meanwhile.
            name: of the timing to which the call's seconds are added.
        """
        watching = watched(phase, self._limit_s)
        if self._is_hosted:
            # Whatever ends this process while it waits for a host, it is not the policy.
            watching = watched("wait for the policy's host")
        with attribute_errors("policy"), watching, self._timed(name):
            yield

    @contextlib.contextmanager
    def environment(self, name: str) -> Iterator[None]:
        """Guard a call of the environment, likewise."""
        with attribute_errors("environment"), watched("environment"), self._timed(name):
            yield

    @contextlib.contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        """Add the seconds that the block takes to the timing of this name.

        Time in a queue, as for a model that another episode uses, is not the policy's; it is added
        to the timing ``policy_queue`` instead.
        """
        start = time.perf_counter()
        queued_before = queued_seconds()
        try:
            yield
        finally:
            queued = queued_seconds() - queued_before
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
        # Policies may raise anything, even KeyboardInterrupt. It is the policy's if this process
        # ignores Ctrl-C, as workers do; else it may be the user's.
        if isinstance(error, KeyboardInterrupt):
            is_ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            if not is_ignored:
                raise
        raise describe_error(source, error) from error
