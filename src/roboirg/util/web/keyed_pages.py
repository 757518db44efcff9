"""Pages that change something: who may open them, what they may load, what they send.

A browser that opens the address with the key gets a cookie, so that the key leaves the address bar
and comes with the page's pictures and requests. Pages of other sites cannot use it: the cookie is
for this site's own requests, and the headers ``Host`` and ``Origin`` must be this server's.
"""

from __future__ import annotations

import hmac
import json
import secrets
from collections.abc import Callable, Sequence
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlencode, urlsplit

from roboirg.core.errors import InvalidValueError
from roboirg.util.web.http_server import HTML_TYPE, BrowserServer, RequestHandler
from roboirg.util.web.request_origin import LOOPBACK, is_own_request, names_of_this_machine

JSON_TYPE = "application/json"
KEY_FILE = "key"
MAX_BODY_BYTES = 65_536
PRIVATE_HEADERS = {
    "Cache-Control": "no-store",
    # With ``no-referrer``, browsers would hide the origin of the page's own requests.
    "Referrer-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'; base-uri 'none'",
}
"""Headers that forbid caching, referrers with a secret, and foreign content."""


def page_policy(nonce: str) -> dict[str, str]:
    """Return the header that allows a page its own style, script, media and requests only."""
    return {
        "Content-Security-Policy": (
            f"default-src 'none'; style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'; "
            "img-src 'self' data:; media-src 'self'; connect-src 'self'; form-action 'self'; "
            "frame-ancestors 'none'; base-uri 'none'"
        )
    }


def stored_key(folder: Path) -> str:
    """Return the key of a folder's pages, made when it is first asked for.

    It is kept, so that pages that are open go on after the server was started again.

    Raises:
        InvalidValueError: the file cannot be read or written.
    """
    path = folder / KEY_FILE
    try:
        if not path.exists():
            path.touch(mode=0o600)
            path.write_text(secrets.token_urlsafe(18) + "\n")
        return path.read_text().strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidValueError(f"Cannot keep the page's key in {path}: {error}.") from error


class KeyedPageServer(BrowserServer):
    """Serves pages to browsers that were given the key.

    Args:
        handler: class of the request handler.
        key: secret in the address.
        host: address to listen at.
        port: 0 for any free port.
        names: further names under which browsers reach this machine.

    Raises:
        InvalidValueError: the port is not available, or the address is not this machine's.
    """

    def __init__(
        self,
        handler: type[KeyedPageHandler],
        key: str,
        host: str = LOOPBACK,
        port: int = 0,
        names: Sequence[str] = (),
    ) -> None:
        super().__init__(host, port, handler)
        self.key, self.host = key, host
        self.names = frozenset({*names_of_this_machine(), host.lower(), *map(str.lower, names)})

    @property
    def url(self) -> str:
        """Address to open, with the key."""
        return f"http://{self.host}:{self.port}/?{urlencode({'key': self.key})}"

    @property
    def cookie(self) -> str:
        """Name of the cookie; servers at other ports have others."""
        return f"roboirg_{self.port}"

    def knows(self, key: str) -> bool:
        """Return whether a key is this server's."""
        return hmac.compare_digest(key.encode(), self.key.encode())


class KeyedPageHandler(RequestHandler):
    """Handle the requests of one connection to a `KeyedPageServer`.

    Subclasses define ``answer_get`` and ``answer_post``, which are called with the path of requests
    that are allowed.
    """

    server: KeyedPageServer

    def answer_get(self, path: str) -> None:
        """Answer a request with the key; subclasses override it."""
        raise NotImplementedError(path)

    def answer_post(self, path: str, body: dict[str, Any]) -> None:
        """Answer a request with the key and a JSON object; subclasses override it."""
        raise NotImplementedError(path, body)

    def do_GET(self) -> None:  # noqa: N802 - name of the base class
        """Exchange the key for a cookie, or answer."""
        parts = urlsplit(self.path)
        key = parse_qs(parts.query).get("key", [""])[0]
        if parts.path == "/" and key and self._is_own() and self.server.knows(key):
            cookie = f"{self.server.cookie}={self.server.key}; HttpOnly; SameSite=Strict; Path=/"
            self.send_head(HTTPStatus.SEE_OTHER, 0, {"Location": "/", "Set-Cookie": cookie})
        elif self._is_allowed():
            self.answer_get(parts.path)

    def do_POST(self) -> None:  # noqa: N802 - name of the base class
        """Read a JSON object and answer; without the key, the body is not read."""
        if not self._is_allowed():
            return
        content = self.read_body(MAX_BODY_BYTES, message="Too large.")
        if content is None:
            return
        try:
            body = json.loads(content)
        except (ValueError, RecursionError):
            body = None
        if not isinstance(body, dict):
            self.send_refusal(HTTPStatus.BAD_REQUEST, "The request is no JSON object.")
            return
        self.answer_post(urlsplit(self.path).path, body)

    def common_headers(self) -> dict[str, str]:
        """Return headers that forbid caching and foreign content."""
        return {**super().common_headers(), **PRIVATE_HEADERS}

    def send_json(self, value: object, status: HTTPStatus = HTTPStatus.OK) -> None:
        """Send a JSON value."""
        self.send_text(json.dumps(value), JSON_TYPE, status)

    def send_page(self, render: Callable[[str], str]) -> None:
        """Send a page; `render` gets the nonce of its style and script."""
        nonce = secrets.token_urlsafe(16)
        self.send_bytes(render(nonce).encode(), HTML_TYPE, headers=page_policy(nonce))

    def send_missing(self) -> None:
        """Refuse a request for something that is not there."""
        self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")

    def _is_own(self) -> bool:
        hosts, origins = self.headers.get_all("Host", []), self.headers.get_all("Origin", [])
        # A proxy may add HTTPS: the page is then the same host's.
        plain = [one.replace("https://", "http://", 1) for one in origins]
        return is_own_request(hosts, plain, self.server.names)

    def _is_allowed(self) -> bool:
        """Return whether a request comes from a page of this server; refuse it if not."""
        allowed = self._is_own() and self.server.knows(self._key())
        if allowed:
            self.server.connections.prove(self.connection)
        else:
            self.send_refusal(
                HTTPStatus.FORBIDDEN, "Open the address that roboirg has printed, with its key."
            )
        return allowed

    def _key(self) -> str:
        """Return the key in the request's cookie; empty if it has none."""
        try:
            cookies = SimpleCookie("; ".join(self.headers.get_all("Cookie", [])))
        except CookieError:
            return ""
        found = cookies.get(self.server.cookie)
        return "" if found is None else found.value
