"""Pages that change something: who may open them, what they may load, what they send.

A browser that opens the address with the key gets a cookie, so that the key leaves the address bar
and comes with the page's pictures and requests. Pages of other sites cannot use it: the cookie is
for this site's own requests, and the headers ``Host`` and ``Origin`` must be this server's.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Callable, Sequence
from urllib.parse import urlencode

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import (
    HTMLResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.routing import BaseRoute

from roboirg.core.errors import RoboIRGError
from roboirg.util.web.app_server import (
    AppServer,
    RequestGuard,
    error_handler,
)
from roboirg.util.web.request_origin import LOOPBACK, is_own_request, names_of_this_machine

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


class KeyedPageServer(AppServer):
    """Serves pages on loopback to browsers that were given the key.

    Args:
        routes: of the pages.
        key: secret in the address.
        port: 0 for any free port.
    """

    def __init__(self, routes: Sequence[BaseRoute], key: str, port: int = 0) -> None:
        """Build the application: routes behind the check of the key; our errors give status 400."""
        self.key = key
        self._names = names_of_this_machine()
        handlers = {RoboIRGError: error_handler(400)}
        app = Starlette(routes=routes, exception_handlers=handlers)
        super().__init__(RequestGuard(app, self._refuse, PRIVATE_HEADERS), port=port)

    @property
    def url(self) -> str:
        """Address to open, with the key."""
        return f"http://{LOOPBACK}:{self.port}/?{urlencode({'key': self.key})}"

    @property
    def cookie(self) -> str:
        """Name of the cookie; servers at other ports have others."""
        return f"roboirg_{self.port}"

    def _refuse(self, request: Request) -> Response | None:
        """Return None to let a request pass; else an answer that sets the cookie, or refuses.

        A request with the cookie passes. The address that is printed has the key. It is exchanged
        for a cookie and left out of the address, so that it is in no browser history.
        """
        if self._is_own(request):
            is_first = request.method == "GET" and request.url.path == "/"
            if is_first and self._is_key(request.query_params.get("key", "")):
                response = RedirectResponse("/", 303)
                response.set_cookie(self.cookie, self.key, httponly=True, samesite="strict")
                return response
            if self._is_key(request.cookies.get(self.cookie, "")):
                return None
        return PlainTextResponse("Open the address that roboirg has printed, with its key.\n", 403)

    def _is_own(self, request: Request) -> bool:
        """Return whether a request comes from no page of another site."""
        hosts = request.headers.getlist("host")
        origins = request.headers.getlist("origin")
        # A proxy may add HTTPS: the page is then the same host's.
        http_origins = [origin.replace("https://", "http://", 1) for origin in origins]
        return is_own_request(hosts, http_origins, self._names)

    def _is_key(self, text: str) -> bool:
        """Return whether a text is the key.

        Takes equally long for every text, as the time of an early end would give letters away.
        """
        return hmac.compare_digest(text.encode(), self.key.encode())


def page_response(render: Callable[[str], str]) -> HTMLResponse:
    """Return a page; `render` gets the nonce of its style and script."""
    nonce = secrets.token_urlsafe(16)
    return HTMLResponse(render(nonce), headers=page_policy(nonce))
