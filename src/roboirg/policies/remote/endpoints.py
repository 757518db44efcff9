"""Addresses of policy servers, and the options that all protocols share."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import quote, urlsplit

from pydantic import AfterValidator, Field

from roboirg.core.actions import find_action_space
from roboirg.core.errors import InvalidValueError
from roboirg.core.handed_keys import remember_key
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.contract.option_checking import NOT_COMPARED, Seconds
from roboirg.policies.contract.policy_urls import UrlOptions
from roboirg.util.web.request_origin import LOOPBACK_NAMES

MIB = 2**20

ActionSpaceName = Annotated[str, AfterValidator(lambda name: find_action_space(name).name)]
"""An option that names an action space."""


@dataclass(frozen=True)
class Endpoint:
    """Host (lower case), port, and path (empty, or from its slash on) of a server."""

    host: str
    port: int
    path: str = ""

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}{self.path}"

    @property
    def identity(self) -> str:
        """A file name, the same for every spelling of this computer's address."""
        host = self.host.replace(":", "_")
        if self.host in LOOPBACK_NAMES:
            host = f"{socket.gethostname()}-itself"
        return f"{host}-{self.port}{quote(self.path, safe='')}"


class RemoteOptions(UrlOptions):
    """Options of every remote policy.

    Attributes:
        timeout: seconds to wait for a reply.
        connect: seconds to try to connect.
        wait: seconds to wait for a server that another episode uses.
        shared: whether several episodes may use a server at the same time.
        tls: whether to encrypt (wss).
        api_key_env: environment variable that holds the server's key.
        max_reply_mib: size limit of a reply, MiB.
        version: of the checkpoint, for the records.
        prompt_tokens: that the model reads of a prompt.
        prompt_added: most tokens of a state or subgoal that share this budget.
        tokenizer: file of the model's tokenizer.
    """

    timeout: Seconds = Field(120.0, gt=0, exclude=NOT_COMPARED)
    connect: Seconds = Field(60.0, gt=0, exclude=NOT_COMPARED)
    wait: Seconds = Field(3600.0, ge=0, exclude=NOT_COMPARED)
    shared: bool = Field(False, exclude=NOT_COMPARED)
    tls: bool = Field(False, exclude=NOT_COMPARED)
    api_key_env: str | None = Field(None, min_length=1, exclude=NOT_COMPARED)
    max_reply_mib: float = Field(16.0, gt=0, exclude=NOT_COMPARED)
    version: str | None = Field(None, min_length=1, exclude=NOT_COMPARED)
    prompt_tokens: int | None = Field(None, ge=1)
    prompt_added: int = Field(0, ge=0)
    tokenizer: str | None = Field(None, min_length=1)

    @property
    def headers(self) -> dict[str, str]:
        """HTTP headers of a request.

        Raises:
            InvalidValueError: the environment variable with the key is not set.
        """
        if self.api_key_env is None:
            return {}
        key = os.environ.get(self.api_key_env)
        if not key:
            raise InvalidValueError(
                f"The environment variable {self.api_key_env} (option api_key_env) holds no key."
            )
        remember_key(key)
        return {"Authorization": f"Api-Key {key}"}


def read_endpoints(url: PolicyRef) -> tuple[Endpoint, ...]:
    """Return the servers of a URL, which commas separate.

    Raises:
        InvalidValueError: a part is not ``host:port`` or ``host:port/path``.
    """
    return tuple(_endpoint(url, part) for part in url.target.split(","))


def _endpoint(url: PolicyRef, text: str) -> Endpoint:
    """Return the server of a part of a URL, such as ``localhost:8001`` or ``host:80/path``.

    `url` is the whole policy, for the error. The host is in lower case; a slash at the end is
    dropped.

    Raises:
        InvalidValueError: it is no host and port.
    """
    complaint = InvalidValueError(
        f"Policy {url.spec!r}: {text!r} is not a server; write {url.kind}://host:port, several "
        "with commas."
    )
    try:
        parts = urlsplit(f"//{text}")
        port = parts.port
    except ValueError:
        raise complaint from None
    if not parts.hostname or not port or parts.fragment or " " in text:
        raise complaint
    return Endpoint(parts.hostname, port, parts.path.rstrip("/"))
