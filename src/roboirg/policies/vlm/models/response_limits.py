"""Size limits of the responses that the providers' client libraries read.

The libraries have none, and unpack whatever is compressed. Both HTTP libraries that they use,
httpx and httpx2, call a hook with each response before its body is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

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
