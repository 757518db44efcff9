"""Base class of the clients of all protocols: the connection of an episode, checked replies."""

from __future__ import annotations

import contextlib
import weakref
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_ANGLE, Actions, check_chunk, find_action_space
from roboirg.core.errors import InvalidActionError, PolicyReplyError
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.policies.contract.json_values import as_json
from roboirg.policies.contract.policy_calls import SERVER
from roboirg.policies.contract.policy_urls import read_options, split_url
from roboirg.policies.remote.endpoints import RemoteOptions, read_endpoints

_MOST_SHOWN = 80
"""Characters of a server's value in an error message."""
_ERROR_KEYS = ("traceback", "message", "detail", "reason", "error")
"""Where servers say what went wrong; the first that a reply has is shown."""
_MOST_KEYS = 8
"""Keys of a server's reply in an error message."""


class RemotePolicy(ABC):
    """A policy on a server, connected from `reset` to `close`.

    Subclasses define `begin_episode` and `request_actions`, and set ``options_type`` if it
    differs. The constructor checks the URL and connects to nothing.

    Args:
        url: one or several servers, and options.
        seed: not sent; servers have seeds of their own.

    Attributes:
        options: of the URL; one named ``actions`` selects the action space.
        connection: to the server of the episode.
        metadata: of the server, as JSON values, from `reset` on.
        instruction: what was said last in the current episode; without `delivery` in turns, the
            whole instruction. Clients send it with every request if the protocol allows it.

    Raises:
        UnknownNameError: the URL has an unknown option.
        InvalidValueError: the URL names no server, or an option has a wrong value.
        MissingDependencyError: a library for connections is not installed.
    """

    options_type: ClassVar[type[RemoteOptions]] = RemoteOptions
    cameras: tuple[str, ...] = CAMERAS
    actions: str = JOINT_ANGLE.name

    def __init__(self, url: str, seed: int = 0) -> None:
        """Check URL and options; connect to nothing yet."""
        from roboirg.policies.remote.connection import ServerConnection

        del seed
        parts = split_url(url)
        self.options = read_options(parts, self.options_type)
        self.prompt_tokens = self.options.prompt_tokens
        self.prompt_added = self.options.prompt_added
        self.tokenizer = self.options.tokenizer
        self.metadata: dict[str, Any] = {}
        self._space = find_action_space(getattr(self.options, "actions", self.actions))
        self.actions = self._space.name
        self.instruction = ""
        self._unsent: Demonstration | None = None
        self.connection = ServerConnection(parts.kind, read_endpoints(parts), self.options)
        # Without a close() the server is unlocked when the policy is deleted.
        weakref.finalize(self, self.connection.end)

    @property
    def version(self) -> str:
        """Version of the checkpoint: the URL's, else the server's, else ``unknown``."""
        if self.options.version is not None:
            return self.options.version
        version = self.metadata.get("version")
        return UNKNOWN_VERSION if version is None else str(version)

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Lock a server, connect, and begin an episode.

        Raises:
            PolicyConnectionError: no server can be reached.
            PolicyTimeoutError: no server was free, or it did not answer in time.
            PolicyReplyError: the server replied with an error or with something else.
        """
        self.instruction = instruction
        self._unsent = demonstration
        with self._closed_on_error():
            self.connection.begin()
            reported = as_json(self.greet())
            self.metadata = {SERVER: "", **reported}
            # Whatever the server calls itself, these are ours to say.
            self.metadata[SERVER] = str(self.connection.endpoint)
            self.metadata["execute"] = getattr(self.options, "execute", None) or "all"
            self.begin_episode(demonstration)

    def act(self, observation: Observation) -> Actions:
        """Return the server's next actions; an error ends the episode.

        Raises:
            PolicyConnectionError: the server went away.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error or with something else.
        """
        self.instruction = observation["instruction"]
        with self._closed_on_error():
            return self.request_actions(observation)

    def greet(self) -> Mapping[str, Any]:
        """Return what a server says about itself on a new connection, which it does first.

        Raises:
            PolicyReplyError: it says that it has failed.
        """
        metadata = self.connection.exchange(None, "its metadata")
        if "error" in (metadata.get("status"), *metadata):
            self.refuse_error(metadata)
        return metadata

    @abstractmethod
    def begin_episode(self, demonstration: Demonstration) -> None:
        """Reset the server; `take_demonstration` has the demonstration for `request_actions`."""

    def take_demonstration(self) -> Demonstration | None:
        """Return the demonstration, which clients send once; None after the first call."""
        demonstration = self._unsent
        self._unsent = None
        return demonstration

    @abstractmethod
    def request_actions(self, observation: Observation) -> Actions:
        """Return the server's next actions, (n, size); see `request` and `read_actions`."""

    def close(self) -> None:
        """End the episode: disconnect and unlock the server; repeated calls do nothing."""
        self.connection.end()

    def request(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message to the server and return the reply.

        Raises:
            PolicyConnectionError: the connection broke, or there is none.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """
        from roboirg.policies.remote.message_codec import pack

        return self.connection.exchange(pack(message))

    def refuse_error(self, reply: Mapping[str, Any]) -> None:
        """Raise if a reply that lacks what was asked for says why.

        Servers have no common form for that: ``{"status": "error", "message": "no memory"}`` and
        ``{"error": {"detail": "no memory"}}`` are two.

        Raises:
            PolicyReplyError: it does.
        """
        for key in _ERROR_KEYS:
            said = reply.get(key)
            if isinstance(said, Mapping):
                self.refuse_error(said)
            elif isinstance(said, str):
                raise self.connection.error_reply(said)

    def request_confirmed(self, message: Mapping[str, Any], key: str) -> None:
        """Send a message whose reply must have True under a key.

        Raises:
            PolicyReplyError: it does not.
        """
        reply = self.request(message)
        confirmed = reply.get(key)
        if confirmed is not True:
            self.refuse_error(reply)
            request = next(iter(message))  # its first key says what it asks for
            raise PolicyReplyError(
                f"{self.connection} did not confirm {request!r}: {key!r} in its reply is "
                f"{str(confirmed)[:_MOST_SHOWN]}."
            )

    def read_actions(self, reply: Mapping[str, Any]) -> NDArray[np.float64]:
        """Return the ``actions`` of a reply, (n, size).

        Raises:
            PolicyReplyError: there are none, or they have a wrong shape or are not finite.
        """
        actions = reply.get("actions")
        if isinstance(actions, Mapping):
            raise PolicyReplyError(
                f"{self.connection} sent actions encoded in another dialect "
                f"(keys {_listed(actions)})."
            )
        if "actions" not in reply:
            self.refuse_error(reply)
            raise PolicyReplyError(
                f"{self.connection} sent a reply without 'actions'; it holds {_listed(reply)}."
            )
        try:
            return check_chunk(reply["actions"], self._space)
        except InvalidActionError as error:
            raise PolicyReplyError(
                f"{self.connection} sent actions that cannot be executed: {error}"
            ) from error

    @contextlib.contextmanager
    def _closed_on_error(self) -> Iterator[None]:
        """Disconnect and unlock the server as soon as the block raises: the episode is over."""
        try:
            yield
        except Exception:
            self.connection.end(is_broken=True)
            raise


def _listed(names: Mapping[Any, Any]) -> str:
    """Return the first keys of a reply, for a message."""
    return ", ".join(map(repr, list(names)[:_MOST_KEYS])) or "nothing"
