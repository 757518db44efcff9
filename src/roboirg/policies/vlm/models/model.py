"""The contract of models: providers, options, queries, and replies with their cost.

A file in `providers/` that defines ``PROVIDER`` is a provider. Installed packages add theirs
through entry points of the group ``roboirg.model_providers``.
"""

from __future__ import annotations

import functools
import json
import math
import os
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Protocol
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, field_validator

from roboirg.core.errors import MissingDependencyError
from roboirg.core.handed_keys import remember_key
from roboirg.policies.contract.option_checking import NOT_COMPARED, Seconds
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.util.discovery import discover
from roboirg.util.reply_reading import whole_number
from roboirg.util.short_hash import short_hash

NO_KEY = "none"
"""Sent as the key to a server that needs none."""
_PRICED_TOKENS = 1_000_000
"""How many tokens a price is for."""
MOST_TOKENS = 100_000_000
"""Of one query or reply: ten times the longest context of a model, ten million tokens."""


class HttpRequest(NamedTuple):
    """What is posted to a service."""

    url: str
    headers: Mapping[str, str]
    body: bytes


class TokenPrices(NamedTuple):
    """Prices of a model in US dollars per million tokens; None if unknown.

    Attributes:
        input: of what is sent.
        output: of what is answered, thoughts included.
    """

    input: float | None = None
    output: float | None = None


class ModelProvider(NamedTuple):
    """A provider: its own service, and an API that other services may share.

    Attributes:
        name: as in options.
        home: URL of its own service.
        key_variable: environment variable with the key of its own service, by default.
        write: returns the request for a query, with JSON as its body; the schema is to be sent.
            It is called with the options, too, and with the key.
        read: returns a reply, which was JSON, as a `ModelReply`; impossible token counts become
            unknown. It may raise any error of a missing or wrong text.
        prices: of models of its own service, by name.
    """

    name: str
    home: str
    key_variable: str
    write: Callable[[ModelQuery, ModelOptions, str], HttpRequest]
    read: Callable[[Any], ModelReply]
    prices: Mapping[str, TokenPrices] = MappingProxyType({})


@functools.cache
def model_providers() -> Mapping[str, ModelProvider]:
    """Return every provider by name."""
    return discover(
        f"{__package__}.providers", "PROVIDER", ModelProvider, "roboirg.model_providers"
    )


class ModelOptions(BaseModel):
    """A model and the options of its queries.

    Attributes:
        provider: ``openai`` for every endpoint with its API, ``google``, or a package's.
        model: its name at the provider.
        base_url: of the endpoint; None for the provider's own.
        api_key_env: environment variable with the key. By default it is the provider's usual one
            for the provider's own service, and none for any other address, so that a key is sent
            only where it belongs.
        timeout_s: seconds for one reply.
        retries: how often a service that cannot be reached is tried again.
        patience_s: how long to wait in all for a service that is busy, as it asks for.
        requests_per_minute: that the service takes from all processes of a run; None for any.
        temperature: None leaves it to the provider.
        max_output_tokens: None leaves it to the provider.
        input_price, output_price: US dollars per million tokens. Without either, they are those
            that the provider declares, or no cost is reported.
        video: send clips as ``mp4`` files, or as pictures (``frames``). Google takes files.
        clip_frames: maximum of pictures per clip, where it is not a file.
        structured: whether to send the JSON schema of the answer.
        sampling_fps: frames per second at which Google samples a clip; None for its default, 1.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    provider: str = "openai"
    model: str = Field(min_length=1)
    base_url: str | None = Field(default=None, exclude=NOT_COMPARED)
    api_key_env: str | None = Field(default=None, exclude=NOT_COMPARED)
    timeout_s: Seconds = Field(default=120.0, gt=0, exclude=NOT_COMPARED)
    retries: int = Field(default=2, ge=0, le=10, exclude=NOT_COMPARED)
    patience_s: Seconds = Field(default=300.0, ge=0, exclude=NOT_COMPARED)
    requests_per_minute: float | None = Field(default=None, ge=0.001, exclude=NOT_COMPARED)
    temperature: float | None = Field(default=0.0, ge=0)
    max_output_tokens: int | None = Field(default=None, ge=1)
    input_price: float | None = Field(default=None, ge=0, exclude=NOT_COMPARED)
    output_price: float | None = Field(default=None, ge=0, exclude=NOT_COMPARED)
    video: Literal["frames", "mp4"] = "frames"
    clip_frames: int = Field(default=16, ge=1)
    structured: bool = True
    sampling_fps: float | None = Field(default=None, gt=0)

    @field_validator("provider")
    @classmethod
    def _is_known(cls, name: str) -> str:
        """Refuse a provider that does not exist."""
        if name not in model_providers():
            raise ValueError(f"Input should be {' or '.join(map(repr, model_providers()))}")
        return name

    @field_validator("base_url")
    @classmethod
    def _has_no_secret(cls, url: str | None) -> str | None:
        """Refuse an address that could hold a secret, or that is none; None is the provider's."""
        parts = urlsplit(url or "http://provider")
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError("an address must begin with http:// or https:// and name a host")
        if "@" in parts.netloc or parts.query:
            raise ValueError(
                "addresses are recorded, so they must not hold a user, password or query; put a "
                "key into an environment variable and name that in api_key_env"
            )
        return url

    def model_post_init(self, _context: object) -> None:
        """Remember the key, if there is one, before stored replies are read."""
        remember_key(os.environ.get(self.key_variable or ""))

    @property
    def key_variable(self) -> str | None:
        """The environment variable with the key; None if none is needed."""
        if self.api_key_env:
            return self.api_key_env
        return None if self.base_url else self.service.key_variable

    @property
    def service(self) -> ModelProvider:
        """The provider: its own service, and how to speak with all that have its API."""
        return model_providers()[self.provider]

    @property
    def url(self) -> str:
        """The address that requests begin with, without a slash at its end."""
        return (self.base_url or self.service.home).rstrip("/")

    @property
    def prices(self) -> TokenPrices:
        """What tokens cost: by the options, or as the provider declares for its own service."""
        prices = TokenPrices(self.input_price, self.output_price)
        if self.base_url or prices != TokenPrices():
            return prices
        return self.service.prices.get(self.model, prices)

    def key(self) -> str:
        """Return the key, or `NO_KEY` if none is needed.

        Raises:
            MissingDependencyError: the environment variable is not set; a run stops, as it could
                play no episode.
        """
        variable = self.key_variable
        if variable is None:
            return NO_KEY
        key = os.environ.get(variable, "").strip()
        if not key:
            raise MissingDependencyError(
                f"Model {self.model!r} needs a key in the environment variable {variable}, "
                "which is not set."
            )
        return key

    def address(self) -> str:
        """Return the URL of the endpoint; the provider's name for its own service."""
        return self.base_url or self.provider

    def about(self) -> dict[str, str | float | int | bool | None]:
        """Return, for records, the address and all that may change a reply; never a key."""
        return {**self.model_dump(mode="json"), "address": self.address()}

    @property
    def has_prices(self) -> bool:
        """Whether the cost of replies is known."""
        return self.prices != TokenPrices()

    def cost_usd(self, reply: ModelReply) -> float:
        """Return what a reply costs in US dollars: 0 without prices.

        NaN if tokens that have a price are not known; such a cost is unknown, not 0.
        """
        cost = 0.0
        prices = self.prices
        if prices.input:
            cost += reply.input_tokens * prices.input
        if prices.output:
            cost += reply.output_tokens * prices.output
        return cost / _PRICED_TOKENS


class ModelQuery(NamedTuple):
    """A query to a model.

    Attributes:
        system: the system prompt.
        turns: the conversation so far; the last turn is the user's.
        schema: JSON schema of the reply, or None for free text.
    """

    system: str
    turns: tuple[ChatTurn, ...]
    schema: Mapping[str, Any] | None = None


class ModelReply(NamedTuple):
    """A model's reply.

    Attributes:
        text: what it said, possibly nothing; thoughts may be in it as `with_thoughts` marks them.
        input_tokens: of the query; NaN if it is unknown.
        output_tokens: of the reply and its thoughts; NaN if it is unknown.
    """

    text: str
    input_tokens: float = math.nan
    output_tokens: float = math.nan


def tokens_of(count: object) -> float:
    """Return a number of tokens as a service reports it; NaN, which is unknown, if it is none.

    Such a number is whole and at most `MOST_TOKENS`.
    """
    number = whole_number(count)
    if number is None or not 0 <= number <= MOST_TOKENS:
        return math.nan
    return number


def given(**entries: Any) -> dict[str, Any]:  # noqa: ANN401 - JSON
    """Return the entries that are not None: ``given(a=1, b=None)`` -> ``{"a": 1}``."""
    return {name: value for name, value in entries.items() if value is not None}


def reported_count(usage: object, name: str, absent: int | None = None) -> float:
    """Return a count of tokens from what a service reports; NaN if it is unknown.

    ``{"prompt_tokens": 12}``, ``"prompt_tokens"`` -> 12.

    Args:
        usage: the counts by name, or anything else.
        name: of the count.
        absent: the count if there is none of that name; None for unknown.
    """
    if not isinstance(usage, dict):
        return math.nan
    return tokens_of(usage.get(name, absent))


class Model(Protocol):
    """A connection to a model, which ends with this object."""

    def answer(self, query: ModelQuery) -> ModelReply:
        """Send a query and return the reply.

        Raises:
            PolicyConnectionError: the service cannot be reached or is overloaded.
            PolicyTimeoutError: there was no reply in time.
            PolicyReplyError: the service replied with an error.
            UnknownCostError: it replied with something else.
        """


def config_version(model: ModelOptions, about: Mapping[str, Any]) -> str:
    """Return the model's name and a fingerprint of all else that may change its answers.

    ``"gpt-4o 1a2b3c4d5e6f"``. The address is left out: a model at another port is the same model.

    Args:
        model: the model and its options.
        about: what else counts, such as the listener's options and prompts, as JSON values.
    """
    about_model = model.about()
    del about_model["address"]
    text = json.dumps({**about, "model": about_model}, sort_keys=True)
    return f"{model.model} {short_hash(text)}"
