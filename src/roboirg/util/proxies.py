"""The proxy through which an address is reached, as the environment's variables name it."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from typing import NamedTuple
from urllib.parse import unquote, urlsplit
from urllib.request import getproxies_environment, proxy_bypass

from roboirg.core.errors import MissingDependencyError
from roboirg.core.handed_keys import remember_key

_LOOPBACK = re.compile(r"(.*\.)?localhost\.?|(::ffff:)?127(\.\d+){1,3}|::1|::|0\.0\.0\.0")
_USABLE = re.compile(r"(https?|socks5h?)://([^\s/?#]*@)?(\[[\da-f:.]+\]|[^\s/:@]+)(:\d{1,5})?/?")


class Proxy(NamedTuple):
    """How an address is reached.

    Attributes:
        url: of the proxy; None without one.
        words: that name it and the variable that holds it, to follow the address; or empty.
    """

    url: str | None = None
    words: str = ""


def proxy_of(url: str) -> Proxy:
    """Return the proxy of an address; this machine has none, and what NO_PROXY lists.

    Raises:
        MissingDependencyError: what a variable holds cannot be used; a run stops.
    """
    parts, named = urlsplit(url), getproxies_environment()
    if _LOOPBACK.fullmatch(parts.hostname or "") or any(
        map(proxy_bypass, (parts.netloc, parts.hostname or ""))
    ):
        return Proxy()
    for variable in (f"{parts.scheme}_proxy", "all_proxy"):
        if found := named.get(variable.removesuffix("_proxy")):
            name = variable if os.environ.get(variable) else variable.upper()
            address = found if "://" in found else f"http://{found}"
            words = (
                f"the proxy {re.sub('(?s)//.*@', '//', address)} of {name}"  # without a password
            )
            if _USABLE.fullmatch(address) and (address[0] != "s" or find_spec("socksio")):
                user = unquote(urlsplit(address).netloc.rpartition("@")[0])
                remember_key(user)
                remember_key(user.partition(":")[2])
                return Proxy(address, f" through {words}")
            raise MissingDependencyError(
                f"For {url}, {words} cannot be used; write http://, https:// or, with the package "
                "socksio (pip install 'httpx[socks]'), socks5://, each with host and port, or list "
                "the host in NO_PROXY."
            )
    return Proxy()
