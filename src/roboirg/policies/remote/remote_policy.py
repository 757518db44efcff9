"""What all remote policies share: an episode's session, and the check of what comes back."""

from __future__ import annotations

import contextlib
import weakref
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import JOINT_ANGLE, ActionSpace, check_chunk
from roboirg.core.errors import InvalidActionError, PolicyReplyError
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.policies.policy_urls import read_options, split_url
from roboirg.policies.remote.endpoints import RemoteOptions, read_endpoints
from roboirg.policies.remote.server_session import Connect, ServerSession
from roboirg.policies.remote.websocket_connection import WebsocketConnection

UNKNOWN_VERSION = "unknown"
_LARGEST_LISTED = 64
"""Numbers of an array in the metadata that are written out."""
_LONGEST_TEXT = 1000


class RemotePolicy(ABC):
    """A policy behind a network connection, which begins at `reset` and ends with `close`.

    Made offline: a URL is checked and nothing is connected.

    Args:
        url: the server or servers, and options.
        seed: is not sent; servers have seeds of their own.

    Raises:
        UnknownNameError: the URL gives an option that there is not.
        InvalidValueError: the URL names no server, or an option has a wrong value.
    """

    options_type: ClassVar[type[RemoteOptions]] = RemoteOptions
    connect: ClassVar[Connect] = WebsocketConnection
    cameras: tuple[str, ...] = CAMERAS
    actions: str = JOINT_ANGLE.name

    def __init__(self, url: str, seed: int = 0) -> None:
        del seed
        parts = split_url(url)
        self.options = read_options(parts, self.options_type)
        self.metadata: dict[str, Any] = {}
        self._space: ActionSpace = JOINT_ANGLE
        self._instruction = ""
        self._session = ServerSession(
            parts.scheme, read_endpoints(parts), self.options, type(self).connect
        )
        # Whoever forgets close() keeps the server no longer than the policy.
        weakref.finalize(self, self._session.end)

    @property
    def version(self) -> str:
        """Of the checkpoint: what the URL says, else what the server says, else ``unknown``."""
        told = self.metadata.get("version")
        return self.options.version or (UNKNOWN_VERSION if told is None else str(told))

    def reset(self, instruction: str, demonstration: Demonstration) -> None:
        """Take a server, connect, and begin an episode.

        Raises:
            PolicyConnectionError: no server can be reached.
            PolicyTimeoutError: no server was free, or it did not answer in time.
            PolicyReplyError: the server answered with an error or with something else.
        """
        self._instruction = instruction
        server = self._session.begin()
        self.metadata = {"server": str(self._session.link.endpoint), **as_json(server)}
        with self._ends_with_error():
            self.begin(demonstration)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """The server's next actions; after an error the episode is over.

        Raises:
            PolicyConnectionError: the server went away.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server answered with an error or with something else.
        """
        with self._ends_with_error():
            return self.answer(observation)

    @abstractmethod
    def begin(self, demonstration: Demonstration) -> None:
        """Tell the server of a new episode; what is shown may be kept until `answer`."""

    @abstractmethod
    def answer(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Ask the server for actions."""

    def close(self) -> None:
        """End the episode: disconnect and let others have the server; may be called again."""
        self._session.end()

    @contextlib.contextmanager
    def _ends_with_error(self) -> Iterator[None]:
        """Let others have the server as soon as an episode cannot go on."""
        try:
            yield
        except Exception:
            self.close()
            raise

    def _rows(self, reply: Mapping[str, Any]) -> NDArray[np.float64]:
        """The actions in a reply, (n, size) and finite."""
        if "actions" not in reply:
            keys = ", ".join(map(repr, list(reply)[:8])) or "nothing"
            raise PolicyReplyError(
                f"{self._session.link} sent a reply without 'actions'; it holds {keys}."
            )
        try:
            return check_chunk(reply["actions"], self._space)
        except InvalidActionError as error:
            raise PolicyReplyError(
                f"{self._session.link} sent actions that cannot be executed: {error}"
            ) from error

    def _confirm(self, message: Mapping[str, Any], key: str) -> None:
        """Send what the server has to confirm with a key."""
        reply = self._session.ask(message)
        if reply.get(key) is not True:
            raise PolicyReplyError(
                f"{self._session.link} did not confirm {next(iter(message))!r}: {key!r} in its "
                f"reply is {str(reply.get(key))[:80]}."
            )


def proprioception(joints: NDArray[Any], gripper: NDArray[Any]) -> NDArray[np.float32]:
    """The state as openpi and MME-VLA have it.

    Args:
        joints: (..., 7) rad.
        gripper: (..., 2) finger positions, m.

    Returns:
        (..., 8): the joints and the first finger.
    """
    state: NDArray[np.float32] = np.concatenate(
        [joints, gripper[..., :1]], axis=-1, dtype=np.float32
    )
    return state


def as_json(value: object) -> Any:  # noqa: ANN401 - JSON has no narrower type
    """A message's content as JSON values; large arrays are described, long texts cut."""
    if isinstance(value, Mapping):
        return {str(key): as_json(held) for key, held in value.items()}
    if isinstance(value, np.ndarray) and value.size > _LARGEST_LISTED:
        return f"array of shape {value.shape}, {value.dtype}"
    if isinstance(value, np.ndarray | np.generic):
        return as_json(value.tolist())
    if isinstance(value, list | tuple):
        return [as_json(held) for held in value]
    plain = value is None or isinstance(value, bool | int)
    if plain or (isinstance(value, float) and np.isfinite(value)):
        return value
    return str(value)[:_LONGEST_TEXT]
