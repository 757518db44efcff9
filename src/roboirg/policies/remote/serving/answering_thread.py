"""The thread in which a served policy answers."""

from __future__ import annotations

import asyncio
import traceback
from concurrent.futures import ThreadPoolExecutor

from roboirg.policies.remote.message_codec import pack, unpack
from roboirg.policies.remote.service import Handler


class AnsweringThread:
    """Answers messages one by one; a policy may belong to the thread that made it."""

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1, "policy")

    async def answer(self, handle: Handler, data: bytes | str) -> bytes | str:
        """Return the reply to a message, or the traceback of an error as text."""
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._executor, _answer, handle, data)

    def stop(self) -> None:
        """Take no more messages."""
        self._executor.shutdown(wait=False, cancel_futures=True)


def _answer(handle: Handler, data: bytes | str) -> bytes | str:
    try:
        if isinstance(data, str):
            raise TypeError("Messages must be binary, not text.")
        return pack(handle(unpack(data)))
    except Exception:  # noqa: BLE001 - the boundary: the policy's author needs the traceback
        return traceback.format_exc()
