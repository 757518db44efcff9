"""The head of a Ray cluster: without it Ray's calls block, and after a minute end this process."""

from __future__ import annotations

import socket
import time

from roboirg.core.errors import RoboIRGError
from roboirg.core.plain_text import counted

POLL_S = 1.0
ANSWER_S = 2.0
"""How long the head may take to answer."""
HEAD_LOST_S = 20.0
"""How long it may not answer before the run stops."""


class ClusterHead:
    """Notes when the head of a cluster last answered.

    Args:
        address: ``host:port``.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._answered_at = time.monotonic()

    def answers(self) -> bool:
        """Return whether the head of the cluster accepts a connection now, and note when it did."""
        host, _, port = self._address.rpartition(":")
        try:
            socket.create_connection((host, int(port)), timeout=ANSWER_S).close()
        except OSError:
            return False
        self._answered_at = time.monotonic()
        return True

    def wait(self, left: int) -> None:
        """Return when the head of the cluster answers, or at once if it did a moment ago.

        Args:
            left: number of episodes that were not played, for the error.

        Raises:
            RoboIRGError: it has not answered for `HEAD_LOST_S` seconds.
        """
        while time.monotonic() - self._answered_at > POLL_S and not self.answers():
            if time.monotonic() - self._answered_at > HEAD_LOST_S:
                raise RoboIRGError(
                    f"The head of the Ray cluster at {self._address} has not answered for "
                    f"{HEAD_LOST_S:g} s; run the same command again to play the remaining "
                    f"{counted(left, 'episode')}."
                )
            time.sleep(POLL_S)
