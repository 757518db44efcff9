"""A model's service behind HTTP: one JSON request and one reply for each query."""

from __future__ import annotations

import json
import math
import threading
import weakref
from collections.abc import Mapping
from concurrent.futures import Future
from http import HTTPStatus
from typing import NamedTuple

from roboirg.core.errors import (
    ModelBusyError,
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
    UnknownCostError,
)
from roboirg.core.extras import extra_needed
from roboirg.core.handed_keys import without_keys
from roboirg.core.waiting import waiting
from roboirg.policies.vlm.models.model import HttpRequest, ModelOptions, ModelQuery, ModelReply
from roboirg.util.proxies import proxy_of

with extra_needed("Models need httpx", "vlm"):
    import httpx

BUSY = frozenset({408, 409, 429, 502, 503, 504})
"""HTTP statuses of a service that is up but cannot answer now."""
MIB = 2**20
MAX_RESPONSE_MIB = 64
MAX_ERROR_LENGTH = 300
_MOST_SHOWN = 80
"""Characters of a reply that is no answer in an error message."""
_MOST_READ = 4096
"""Bytes of such a reply that are read for the message; keys in them are removed."""
MALFORMED = (
    ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError,
)  # fmt: skip
"""What reading a reply of the wrong form raises."""


class _Response(NamedTuple):
    """What a service replied."""

    status: int
    headers: Mapping[str, str]
    content: bytes


class HttpModel:
    """Posts queries as the provider's API wants them, and returns its replies.

    Raises:
        MissingDependencyError: the environment names a proxy that cannot be used; a run stops.
    """

    def __init__(self, options: ModelOptions) -> None:
        """Read the key and the proxy from the environment; nothing is sent yet."""
        self.options = options
        self._key = options.key()
        proxy = proxy_of(options.url)
        self._name = f"Model {options.model!r} at {options.address()}{proxy.words}"
        self._proxy_url = proxy.url
        self._client = self._new_client()

    def answer(self, query: ModelQuery) -> ModelReply:
        """Send a query and return the reply; errors become those that `Model` names.

        Status 200 with JSON of the provider's form is a reply. JSON of another form may have been
        paid for (UnknownCostError); of other statuses, some mean *later* (ModelBusyError), the rest
        are refusals.
        """
        if not self.options.structured:
            query = query._replace(schema=None)
        service = self.options.service
        # No error is chained: the service's message may hold the key, and tracebacks are recorded.
        try:
            response = self._post(service.write(query, self.options, self._key))
        except (TimeoutError, httpx.TimeoutException):
            raise PolicyTimeoutError(
                f"{self._name} did not answer within {self.options.timeout_s:g} s; raise "
                "timeout_s, or shorten answers with max_output_tokens."
            ) from None
        except (httpx.TransportError, httpx.InvalidURL) as error:
            raise PolicyConnectionError(
                f"{self._name} cannot be reached ({type(error).__name__}: {_quote(error)})."
            ) from None
        except MALFORMED as error:
            raise self._not_a_reply(error) from None
        if response.status == HTTPStatus.OK:
            return self._read(response)
        text = response.content.decode(errors="replace")
        words = f"HTTP status {response.status}: {_quote(text)}"
        if response.status in BUSY:
            raise ModelBusyError(
                f"{self._name} is not available: {words}", retry_after_s(response.headers)
            )
        raise PolicyReplyError(f"{self._name} refused or failed: {words}")

    def _read(self, response: _Response) -> ModelReply:
        """Return the reply in a response of status 200; raise UnknownCostError if there is none."""
        try:
            content = json.loads(response.content)
            if content.get("error"):
                raise ValueError("it reports an error")
            reply = self.options.service.read(content)
        except MALFORMED as error:
            beginning = _quote(response.content[:_MOST_READ].decode(errors="replace"))
            kind = _quote(response.headers.get("content-type"))
            came = f", {kind} that begins {beginning[:_MOST_SHOWN]!r}"
            raise self._not_a_reply(error, came) from None
        return reply._replace(text=without_keys(reply.text))

    def _not_a_reply(self, error: Exception, came: str = "") -> UnknownCostError:
        """Return the error about what is no reply, with what came instead, if that is known."""
        return UnknownCostError(
            f"{self._name} replied with something else{came} ({type(error).__name__}: "
            f"{_quote(error)})."
        )

    def _new_client(self) -> httpx.Client:
        """Return a client without connections, which end with this object at the latest."""
        # The library itself takes a proxy for this machine, too, and does not name it.
        transport = httpx.HTTPTransport(proxy=self._proxy_url)
        client = httpx.Client(transport=transport, timeout=self.options.timeout_s)
        weakref.finalize(self, client.close)
        return client

    def _post(self, request: HttpRequest) -> _Response:
        """Post a request and return the response; raise what `_fetch` has raised.

        The client's limits are those of single reads, which begin again with every byte; so a
        thread reads, and the time until it is done is limited here. A connection whose time is over
        is closed, so that the thread ends, even if the service sends for ever.
        """
        fetched: Future[_Response] = Future()
        thread = threading.Thread(target=self._fetch, args=(request, fetched), daemon=True)
        with waiting(f"the reply of {self._name}"):
            thread.start()
            try:
                return fetched.result(timeout=self.options.timeout_s)
            except TimeoutError:
                self._client.close()
                self._client = self._new_client()
                raise

    def _fetch(self, request: HttpRequest, fetched: Future[_Response]) -> None:
        """Post a request; put the response, or any error, where another thread waits.

        Runs in a thread of its own. The error is a `ValueError` if the content is too large.
        """
        # A few compressed kilobytes may become gigabytes: nothing is unpacked.
        plain = {"Content-Type": "application/json", "Accept-Encoding": "identity"}
        headers = {**plain, **request.headers}
        content = bytearray()
        try:
            with self._client.stream(
                "POST", request.url, content=request.body, headers=headers
            ) as response:
                for piece in response.iter_raw():
                    content += piece
                    if len(content) > MAX_RESPONSE_MIB * MIB:
                        raise ValueError(f"the response has more than {MAX_RESPONSE_MIB} MiB")
            fetched.set_result(_Response(response.status_code, response.headers, bytes(content)))
        except BaseException as error:  # noqa: BLE001 - raised again in the waiting thread
            fetched.set_exception(error)


def _quote(words: object) -> str:
    """Return the beginning of what a service said, without keys."""
    return " ".join(without_keys(str(words)).split())[:MAX_ERROR_LENGTH]


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return the seconds after which a service wants to be asked again; None if it names none."""
    try:
        seconds = float(headers.get("retry-after", "nan"))
    except ValueError:  # a date
        return None
    return seconds if 0 <= seconds < math.inf else None
