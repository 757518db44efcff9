"""A bounded wait for a call that itself may last for ever, such as one to a dripping server."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

from roboirg.core.errors import PolicyTimeoutError

Value = TypeVar("Value")


def within(seconds: float, call: Callable[[], Value], what: str) -> Value:
    """What a call returns, if it does so in time.

    The limits of HTTP clients are for one read each; this one is for the whole answer. A call that
    takes longer is left to itself in a thread that does not keep the process alive.

    Raises:
        PolicyTimeoutError: it did not; the sentence names `what`.
    """
    future: Future[Value] = Future()

    def work() -> None:
        try:
            future.set_result(call())
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            future.set_exception(error)

    threading.Thread(target=work, daemon=True, name=f"asking {what}").start()
    try:
        return future.result(timeout=seconds)
    except TimeoutError:
        if future.done():  # the call's own
            raise
        raise timed_out(what, seconds) from None


def timed_out(what: str, seconds: float) -> PolicyTimeoutError:
    """The error for an answer that took too long."""
    return PolicyTimeoutError(f"{what} did not answer within {seconds:g} s.")
