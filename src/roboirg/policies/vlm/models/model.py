"""The contract of models: options, queries, and replies with their cost."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, field_validator

from roboirg.core.errors import MissingDependencyError
from roboirg.core.handed_keys import remember_key
from roboirg.policies.contract.option_checking import NOT_COMPARED, Seconds
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.util.reply_reading import whole_number
from roboirg.util.short_hash import short_hash

Provider = Literal["openai", "google"]

KEY_VARIABLES: Mapping[Provider, str] = {"openai": "OPENAI_API_KEY", "google": "GOOGLE_API_KEY"}
"""Environment variables with the keys of the providers' own services, by default."""
NO_KEY = "none"
"""Sent as the key to a server that needs none."""
_PRICED_TOKENS = 1_000_000
"""Prices are those of so many tokens."""
MOST_TOKENS = 100_000_000
"""Of one query or reply: ten times the longest context of a model, ten million tokens."""


class ModelOptions(BaseModel):
    """A model and the options of its queries.

    Attributes:
        provider: ``openai`` for every endpoint with its API, or ``google``.
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
        input_price, output_price: US dollars per million tokens; without them no cost is reported.
        video: send clips as ``mp4`` files, or as pictures (``frames``). Google takes files.
        clip_frames: maximum of pictures per clip, where it is not a file.
        structured: whether to send the JSON schema of the answer.
        sampling_fps: frames per second at which Google samples a clip; None for its default, 1.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    provider: Provider = "openai"
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

    @field_validator("base_url")
    @classmethod
    def _has_no_secret(cls, url: str | None) -> str | None:
        """Refuse an address that could hold a secret, or that is none."""
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
        return None if self.base_url else KEY_VARIABLES.get(self.provider)

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
        return self.input_price is not None or self.output_price is not None

    def cost_usd(self, reply: ModelReply) -> float:
        """Return what a reply costs: 0 without prices, NaN if tokens with a price are unknown."""
        cost = 0.0
        if self.input_price:
            cost += reply.input_tokens * self.input_price
        if self.output_price:
            cost += reply.output_tokens * self.output_price
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

    The address is left out: a model at another port is the same model.
    """
    about_model = model.about()
    del about_model["address"]
    text = json.dumps({**about, "model": about_model}, sort_keys=True)
    return f"{model.model} {short_hash(text)}"
