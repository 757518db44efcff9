"""Messages in envelopes over a websocket, as in vla-eval: type, payload, number and time.

The client speaks first, and a reply has the number of its request. Beginning and end of an episode
have no reply; an error in them comes before the next one.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, NoReturn

from roboirg.core.errors import PolicyReplyError
from roboirg.core.version import __version__
from roboirg.policies.remote.client.websocket_connection import WebsocketConnection
from roboirg.policies.remote.connections import error_reply, read_reply
from roboirg.policies.remote.message_codec import TEXT_KEYS, pack

PROTOCOL_VERSION = 1
_HELLO, _OBSERVATION, _ACTION, _ERROR = "hello", "observation", "action", "error"


class EnvelopeConnection(WebsocketConnection):
    """A connection to a model server of vla-eval, open until `close` or an error.

    Messages are maps of ``type`` and ``payload``; the reply to an observation is the payload of the
    action, and that to any other message is empty.

    Args:
        spec: the server, and the limits of waits and replies.

    Raises:
        PolicyConnectionError: the server cannot be reached in time, or refuses.
        PolicyTimeoutError: the server accepts but sends no hello.
        PolicyReplyError: its hello is malformed, or of another version of the protocol.
    """

    _number = 0

    def read_metadata(self, seconds: float) -> Mapping[str, Any]:
        """Greet the server and return what it says about itself."""
        hello = {"harness_version": f"roboirg {__version__}", "protocol_version": PROTOCOL_VERSION}
        self._send_envelope(_HELLO, hello)
        told = self._receive_payload(_HELLO, "its metadata", seconds)
        if told.get("protocol_version") != PROTOCOL_VERSION:
            raise PolicyReplyError(
                f"{self.spec} speaks version {str(told.get('protocol_version'))[:80]} of "
                f"vla-eval's protocol; this client speaks version {PROTOCOL_VERSION}."
            )
        version = f"{told.get('model_server')}, vla-eval {told.get('harness_version')}"
        return {"version": version, **told}

    def exchange(self, message: Mapping[str, Any], seconds: float) -> dict[str, Any]:
        """Send a message and return the payload of its reply."""
        self._send_envelope(message["type"], message["payload"])
        if message["type"] != _OBSERVATION:
            return {}
        return self._receive_payload(_ACTION, "a reply", seconds)

    def refuse_surplus(self, surplus: str | bytes) -> NoReturn:
        """Raise the error that the server sent after a message without a reply."""
        if isinstance(surplus, bytes):
            self._raise_error(self._read(surplus))
        super().refuse_surplus(surplus)

    def _send_envelope(self, kind: str, payload: Mapping[str, Any]) -> None:
        self._number += 1
        envelope = {
            "type": kind,
            "payload": payload,
            "seq": self._number,
            "timestamp": time.time(),
        }
        self.send(pack(envelope, TEXT_KEYS))

    def _receive_payload(self, kind: str, what: str, seconds: float) -> dict[str, Any]:
        envelope = self._read(self.receive(what, seconds))
        self._raise_error(envelope)
        found, number, payload = (envelope.get(name) for name in ("type", "seq", "payload"))
        if found != kind or number != self._number or not isinstance(payload, dict):
            raise PolicyReplyError(
                f"{self.spec} sent a message of type {str(found)[:80]!r} with number "
                f"{str(number)[:80]}, where {kind!r} with number {self._number} was expected."
            )
        return payload

    def _raise_error(self, envelope: Mapping[str, Any]) -> None:
        if envelope.get("type") == _ERROR:
            payload = envelope.get("payload")
            told = payload.get("error") if isinstance(payload, dict) else payload
            raise error_reply(self.spec, str(told))

    def _read(self, data: bytes) -> dict[str, Any]:
        return read_reply(self.spec, data, TEXT_KEYS)
