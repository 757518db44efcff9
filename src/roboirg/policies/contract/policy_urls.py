"""URLs that name policies: the scheme says which kind, the query holds options."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple, TypeVar
from urllib.parse import parse_qsl, unquote

from pydantic import BaseModel, ConfigDict

from roboirg.core.errors import InvalidValueError
from roboirg.policies.contract.option_checking import check_options

_SEPARATOR = "://"
_URL = re.compile(r"[\w+.-]*://")


class PolicyUrl(NamedTuple):
    """The parts of a URL.

    Attributes:
        text: the whole URL.
        scheme: before ``://``.
        place: from there to the query.
        options: of the query.
    """

    text: str
    scheme: str
    place: str
    options: Mapping[str, str]


class UrlOptions(BaseModel):
    """Options of a scheme: one field each, with type, limits and default."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Options = TypeVar("Options", bound=UrlOptions)


def is_url(spec: str) -> bool:
    """Return whether a policy's spec is a URL; a URL among its options does not count."""
    return _URL.match(spec) is not None


def split_url(spec: str) -> PolicyUrl:
    """Split a URL into its parts.

    Raises:
        InvalidValueError: there is nothing after the scheme, or the query is malformed.
    """
    scheme, _, rest = spec.partition(_SEPARATOR)
    place, _, query = rest.partition("?")
    if not place.strip("/"):
        raise InvalidValueError(f"Policy {spec!r} names nothing after {scheme}{_SEPARATOR}.")
    return PolicyUrl(spec, scheme, unquote(place), parse_query(spec, query))


def parse_query(spec: str, query: str) -> dict[str, str]:
    """Return the options in the query of a policy's spec.

    Raises:
        InvalidValueError: the query is malformed, or gives an option twice.
    """
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


def read_options(url: PolicyUrl, kind: type[Options]) -> Options:
    """Return the options of a URL, checked.

    Raises:
        UnknownNameError: the scheme has no such option; the message names the nearest.
        InvalidValueError: an option has an invalid value.
    """
    return check_options(kind, url.options, f"Policy {url.text!r}")
