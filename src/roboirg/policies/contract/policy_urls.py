"""URLs that name policies: the scheme says which kind, the query holds options."""

from __future__ import annotations

import re
from urllib.parse import parse_qsl, unquote

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.contract.option_checking import Options, check_options

_URL = re.compile(r"[\w+.-]*://")
_KEY = re.compile(
    r"(?i)(//)[^/?#&\s@]+(?=@)|([?&](?:api_?key|access_token|token|secret|password)=)[^&#]+"
)
"""A user with a password in a URL, or the value of an option that is a key."""


class UrlOptions(BaseModel):
    """Options of a scheme: one field each, with type, limits and default."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def is_url(spec: str) -> bool:
    """Return whether a policy's spec is a URL; a URL among its options does not count."""
    return _URL.match(spec) is not None


def split_url(spec: str) -> PolicyRef:
    """Return the policy of a URL: the scheme is its kind, its target what follows.

    ``openpi://host:8000?execute=5`` -> kind ``openpi``, target ``host:8000``, option ``execute``.

    Raises:
        InvalidValueError: there is nothing after the scheme, or the query is malformed.
    """
    scheme, _, rest = spec.partition("://")
    place, _, query = rest.partition("?")
    if not place.strip("/"):
        raise InvalidValueError(f"Policy {spec!r} names nothing after {scheme}://.")
    options = tuple(parse_query(spec, query).items())
    return PolicyRef(name=spec, spec=spec, kind=scheme, target=unquote(place), options=options)


def parse_query(spec: str, query: str) -> dict[str, str]:
    """Return the options in the query of a policy's spec: ``a=1&b=x`` -> ``{"a": "1", "b": "x"}``.

    Args:
        spec: the whole of it, for errors; it must hold no key or password.
        query: what stands behind its ``?``.

    Raises:
        InvalidValueError: the query is malformed, gives an option twice, or holds a key.
    """
    # A key may be anywhere in the spec, and percent-encoded.
    plain = unquote(spec)
    shown = _KEY.sub(r"\1\2…", plain)
    if shown != plain:
        raise InvalidValueError(
            f"Policy {shown!r} holds a key or password, which plans and records would keep; put it "
            "into an environment variable and name that with api_key_env=NAME."
        )
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError as error:
        raise InvalidValueError(
            f"{spec!r}: options are written ?name=value&name=value, not {query!r}."
        ) from error
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise InvalidValueError(f"{spec!r} gives the option {name!r} twice.")
    return dict(pairs)


def read_options(url: PolicyRef, kind: type[Options]) -> Options:
    """Return the options of a URL, checked.

    Raises:
        UnknownNameError: the scheme has no such option; the message names the nearest.
        InvalidValueError: an option has an invalid value.
    """
    return check_options(kind, dict(url.options), f"Policy {url.spec!r}")
