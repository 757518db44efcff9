"""A time limit for a call that may never return, such as one to a server that drips bytes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from roboirg.core.errors import PolicyTimeoutError
from roboirg.core.waiting import waiting

Value = TypeVar("Value")


def call_with_timeout(seconds: float, call: Callable[[], Value], what: str) -> Value:
    """Return the result of a call, if it comes in time.

    The limits of HTTP clients apply to single reads; this one applies to the whole reply. A call
    that takes longer continues in a daemon thread.

    Raises:
        PolicyTimeoutError: it does not; the message names `what`.
    """
    future: Future[Value] = Future()

    def work() -> None:
        try:
            future.set_result(call())
        except BaseException as error:  # noqa: BLE001 - raised again in the waiting thread
            future.set_exception(error)

    threading.Thread(target=work, daemon=True, name=f"query of {what}").start()
    try:
        with waiting(f"the reply of {what}"):
            return future.result(timeout=seconds)
    except TimeoutError:
        if future.done():  # raised by the call
            raise
        raise timeout_error(what, seconds) from None


def timeout_error(what: str, seconds: float) -> PolicyTimeoutError:
    """Return the error for a reply that took too long."""
    return PolicyTimeoutError(f"{what} did not answer within {seconds:g} s.")
