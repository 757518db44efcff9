"""Limits of the responses that the providers' client libraries read: their size and their time.

The libraries have no limit of size, and unpack whatever is compressed. Both HTTP libraries that
they use, httpx and httpx2, call a hook with each response before its body is read.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any, TypeVar

from roboirg.core.errors import PolicyTimeoutError
from roboirg.core.waiting import waiting
from roboirg.policies.remote.endpoints import MIB

MAX_RESPONSE_BYTES = 64 * MIB
PLAIN_HEADERS: Mapping[str, str] = {"Accept-Encoding": "identity"}
"""Asks for responses that are not compressed: a few kilobytes may become gigabytes."""


def limit_response(response: Any) -> None:  # noqa: ANN401 - of either library
    """Refuse a compressed response, and limit the size of the others; a hook for responses.

    Raises:
        ValueError: the response is compressed, now; or is too large, when it is read.
    """
    encoding = response.headers.get("Content-Encoding", "identity")
    if encoding.strip().lower() != "identity":
        raise ValueError("the response is compressed, which was not asked for")
    stream = response.stream
    base = next(kind for kind in type(stream).__mro__ if kind.__name__ == "SyncByteStream")

    def pieces(_self: object) -> Iterator[bytes]:
        left = MAX_RESPONSE_BYTES
        for piece in stream:
            left -= len(piece)
            if left < 0:
                raise ValueError(f"the response has more than {MAX_RESPONSE_BYTES // MIB} MiB")
            yield piece

    # The libraries check the class, and each has its own.
    limited = {"__iter__": pieces, "close": lambda _self: stream.close()}
    response.stream = type("LimitedStream", (base,), limited)()


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return the seconds after which a service wants to be asked again; None if it names none."""
    for name, unit in (("retry-after-ms", 0.001), ("retry-after", 1.0)):
        value = headers.get(name)
        with contextlib.suppress(TypeError, ValueError):
            seconds = float(value) * unit  # type: ignore[arg-type]
            if math.isfinite(seconds) and seconds >= 0:
                return seconds
    return None


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
    return PolicyTimeoutError(
        f"{what} did not answer within {seconds:g} s; raise timeout_s, or shorten answers with "
        "max_output_tokens."
    )
