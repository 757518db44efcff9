"""What every model is: a question goes in, a reply with what it cost comes out."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, field_validator

from roboirg.core.errors import MissingDependencyError
from roboirg.policies.planning.model_content import ChatTurn

Provider = Literal["openai", "google"]

KEY_VARIABLES: Mapping[Provider, str] = {"openai": "OPENAI_API_KEY", "google": "GOOGLE_API_KEY"}
"""Where the key of a provider's own service is, unless the options name another variable."""
NO_KEY = "none"
"""What is sent as the key to a server that wants none."""


class ModelOptions(BaseModel):
    """Which model is asked, and how.

    Attributes:
        provider: ``openai`` for every endpoint that speaks its dialect, or ``google``.
        model: its name at the provider.
        base_url: of the endpoint; None is the provider's own.
        api_key_env: the environment variable with the key. By default the provider's usual one
            for the provider's own service, and none for any other address: a key is never sent
            where nobody asked for it to go.
        timeout_s: seconds for one answer, retries of the connection included.
        retries: how often the client library tries again when the service is busy or away.
        temperature: None leaves it to the provider.
        max_output_tokens: None leaves it to the provider.
        input_price, output_price: US dollars per million tokens; without them no cost is told.
        video: clips as ``mp4`` files, or as single pictures (``frames``). Google takes files.
        clip_frames: pictures that stand for a clip at most, where it is not a file.
        structured: whether the service is given the JSON schema of the answer to keep to.
        sampling_fps: frames per second at which Google looks at a clip; None is its default, 1.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    provider: Provider = "openai"
    model: str = Field(min_length=1)
    base_url: str | None = None
    api_key_env: str | None = None
    timeout_s: float = Field(default=120.0, gt=0)
    retries: int = Field(default=2, ge=0, le=10)
    temperature: float | None = Field(default=0.0, ge=0)
    max_output_tokens: int | None = Field(default=None, ge=1)
    input_price: float | None = Field(default=None, ge=0)
    output_price: float | None = Field(default=None, ge=0)
    video: Literal["frames", "mp4"] = "frames"
    clip_frames: int = Field(default=16, ge=1)
    structured: bool = True
    sampling_fps: float | None = Field(default=None, gt=0)

    @field_validator("base_url")
    @classmethod
    def _holds_no_secret(cls, url: str | None) -> str | None:
        parts = urlsplit(url or "http://provider")
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError("an address begins with http:// or https:// and names a host")
        if "@" in parts.netloc or parts.query:
            raise ValueError(
                "an address ends up in records, so it holds no user, password or query; put a key "
                "into an environment variable and name that in api_key_env"
            )
        return url

    def key(self) -> str:
        """The key, or `NO_KEY` if none is needed.

        Raises:
            MissingDependencyError: the variable that is to hold it is not set, so that no episode
                can be played; a run stops.
        """
        variable = self.api_key_env
        if variable is None:
            if self.base_url is not None:
                return NO_KEY
            variable = KEY_VARIABLES[self.provider]
        key = os.environ.get(variable, "")
        if not key:
            raise MissingDependencyError(
                f"Model {self.model!r} needs a key in the environment variable {variable}, "
                "which is not set."
            )
        return key

    def address(self) -> str:
        """Where the model is; the provider's name for its own service."""
        return self.base_url or self.provider

    def about(self) -> dict[str, str | float | int | bool | None]:
        """What records say: all that may change an answer, and where it came from; never a key."""
        silent = {"base_url", "api_key_env", "timeout_s", "retries", "input_price", "output_price"}
        return {**self.model_dump(mode="json", exclude=silent), "address": self.address()}


class ModelQuery(NamedTuple):
    """A question to a model.

    Attributes:
        system: who it is and what it is to do.
        turns: the conversation so far; the last one is the user's.
        schema: JSON schema of the answer, or None for words.
    """

    system: str
    turns: tuple[ChatTurn, ...]
    schema: Mapping[str, Any] | None = None


class ModelReply(NamedTuple):
    """What a model answered; empty if it said nothing."""

    text: str
    input_tokens: int = 0
    output_tokens: int = 0


class Model(Protocol):
    """Anything that answers questions."""

    def answer(self, query: ModelQuery) -> ModelReply:
        """Ask.

        Raises:
            PolicyConnectionError: the service cannot be reached or is overloaded.
            PolicyTimeoutError: there was no answer in time.
            PolicyReplyError: the service answered with an error or with something else.
        """

    def close(self) -> None:
        """Let go of the connection."""
