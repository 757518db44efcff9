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
"""Address of a proxy: scheme, perhaps user and password, host or IPv6 address, perhaps a port."""


class Proxy(NamedTuple):
    """How an address is reached.

    Attributes:
        url: of the proxy; None without one.
        words: that name it and the variable that holds it, to follow the address; or empty.
    """

    url: str | None = None
    words: str = ""


def proxy_of(url: str) -> Proxy:
    """Return the proxy through which an address is reached, from the environment's variables.

    There is none for this machine, for what NO_PROXY lists, and without a variable for its scheme.
    For an address with https, ``https_proxy`` counts before ``all_proxy``.

    Raises:
        MissingDependencyError: what a variable holds cannot be used; a run stops.
    """
    parts = urlsplit(url)
    host = parts.hostname or ""
    if _LOOPBACK.fullmatch(host) or proxy_bypass(parts.netloc) or proxy_bypass(host):
        return Proxy()
    proxies = getproxies_environment()
    for kind in (parts.scheme, "all"):
        if proxies.get(kind):
            return _usable_proxy(proxies[kind], f"{kind}_proxy", url)
    return Proxy()


def _usable_proxy(value: str, variable: str, url: str) -> Proxy:
    """Return the proxy that a variable holds, whose password is remembered as a secret.

    Args:
        value: of the variable.
        variable: its name, in lower case; that in upper case may be the one that is set.
        url: that is reached through it.

    Raises:
        MissingDependencyError: it cannot be used.
    """
    name = variable if os.environ.get(variable) else variable.upper()
    address = value if "://" in value else f"http://{value}"
    shown = re.sub("(?s)//.*@", "//", address)  # without a password
    words = f"the proxy {shown} of {name}"
    is_socks = address.startswith("s")  # usable schemes: http, https and those of SOCKS
    if not _USABLE.fullmatch(address) or (is_socks and not find_spec("socksio")):
        raise MissingDependencyError(
            f"For {url}, {words} cannot be used; write http://, https:// or, with the package "
            "socksio (pip install 'httpx[socks]'), socks5://, each with host and port, or list "
            "the host in NO_PROXY."
        )
    user = unquote(urlsplit(address).netloc.rpartition("@")[0])
    password = user.partition(":")[2]
    remember_key(user)
    remember_key(password)
    return Proxy(address, f" through {words}")
