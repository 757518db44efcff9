"""Policy servers on real sockets, written from the protocols' descriptions, with faults on demand.

Nothing here is the benchmark's own: not the codec, not the server. As the published servers do,
they compute in the event loop, so that nothing else is answered meanwhile.
"""

import asyncio
import contextlib
import functools
import threading
import time
import traceback

import msgpack
import numpy as np
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

CHUNK = 20


def encode(value, spell=str.encode):
    if isinstance(value, np.ndarray):
        kept = {"data": value.tobytes(), "dtype": value.dtype.str, "shape": value.shape}
        return {spell(name): part for name, part in {"__ndarray__": True, **kept}.items()}
    raise TypeError(type(value))


def decode(value, spell=str.encode):
    if spell("__ndarray__") in value:
        flat = np.frombuffer(value[spell("data")], np.dtype(value[spell("dtype")]))
        return flat.reshape(value[spell("shape")])
    return value


encode_texts = functools.partial(encode, spell=str)
decode_texts = functools.partial(decode, spell=str)
"""As vla-eval spells it."""


def pack(message):
    return msgpack.packb(message, default=encode)


def unpack(data):
    return msgpack.unpackb(data, object_hook=decode)


class WireServer:
    """A server whose policy is the method `answer`.

    `faults` are consumed one for each message: None for none; "die" drops the connection, "close"
    closes it with a reason, "twice" sends the reply twice, a number of seconds delays it, bytes or
    text are sent as they are, and a dictionary is sent instead of the reply. Messages may have
    `most_bytes` bytes.
    """

    def __init__(self, port=0, faults=(), most_bytes=None):
        self._most_bytes = most_bytes
        self.metadata = {}
        self.port = port
        self.faults = list(faults)
        self.messages = []
        self.connections = 0
        self.open = 0
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._main()), daemon=True)

    def answer(self, message):
        return {"actions": np.full((CHUNK, 8), 0.25)}

    def __enter__(self):
        self._thread.start()
        assert self._ready.wait(300)
        return self

    def __exit__(self, *_):
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(300)

    @property
    def place(self):
        return f"127.0.0.1:{self.port}"

    async def _main(self):
        self._loop = asyncio.get_running_loop()
        self._stop = asyncio.Event()
        async with serve(
            self._handle,
            "127.0.0.1",
            self.port,
            compression=None,
            max_size=self._most_bytes,
            process_request=self._request,
            close_timeout=0.5,
        ) as server:
            self.port = server.sockets[0].getsockname()[1]
            self._ready.set()
            await self._stop.wait()

    def _request(self, connection, request):
        self.path = request.path

    async def _handle(self, websocket):
        self.connections += 1
        self.open += 1
        try:
            await self._begin(websocket)
            await self._converse(websocket)
        except ConnectionClosed:
            pass
        finally:
            self.open -= 1

    async def _begin(self, websocket):
        await websocket.send(pack(self.metadata))

    async def _converse(self, websocket):
        while True:
            data = await websocket.recv()
            self.messages.append(data)
            fault = self.faults.pop(0) if self.faults else None
            if fault == "die":
                websocket.transport.abort()
                return
            if fault == "close":
                await websocket.close(1011, "No memory is left")
                return
            if isinstance(fault, int | float):
                await asyncio.sleep(fault)
                fault = None
            try:
                reply = self.answer(unpack(data))
            except Exception:  # noqa: BLE001
                with contextlib.suppress(ConnectionClosed):
                    await websocket.send(traceback.format_exc())
                    await websocket.close(1011, "Internal server error.")
                return
            if isinstance(fault, dict):
                fault = pack(fault)
            if fault == "twice":
                await websocket.send(pack(reply))
                fault = None
            await websocket.send(pack(reply) if fault is None else fault)


class MmeVlaServer(WireServer):
    """One memory for all connections, which has to hold the current frame before an inference.

    The answer tells what the server knows: row n, column 0 is the frames in memory, column 1 where
    the policy's turn began, column 2 the brightness of the newest frame, column 3 inferences since
    the reset, column 4 counts the rows.
    """

    def __init__(self, *args, delay=0.0, **kwargs):
        super().__init__(*args, **kwargs)
        self.delay = delay
        self.forget()
        self.parts = []
        self.prompts = []
        self.subgoals = []

    def forget(self):
        self.frames = 0
        self.start = 0
        self.newest = None
        self.inferences = 0

    def answer(self, message):
        time.sleep(self.delay)
        if message.get("reset"):
            self.forget()
            return {"reset_finished": True, "reset_time_ms": 0.1}
        if message.get("add_buffer"):
            return self.remember(message)
        return self.infer(message)

    def remember(self, message):
        images = message["images"]
        state = message["state"]
        assert images.dtype == np.uint8, images.dtype
        assert images.ndim == 5, images.shape
        assert images.shape[1] == 1, images.shape
        assert state.shape == (len(images), 8), state.shape
        assert state.dtype == np.float32, state.dtype
        assert not images.flags.writeable
        self.frames += len(images)
        assert self.frames <= 4096, "step index out of the table"
        if self.start == 0:
            self.start = message["exec_start_idx"]
        self.newest = images[-1, 0]
        self.parts.append(len(images))
        return {"add_buffer_finished": True, "add_buffer_time_ms": 0.1}

    def infer(self, message):
        assert self.frames > 0, "the memory is empty"
        assert np.array_equal(self.newest, message["observation/image"]), "not the newest frame"
        assert message["observation/state"].shape == (8,)
        self.inferences += 1
        self.prompts.append(message["prompt"])
        self.subgoals.append((message.get("simple_subgoal"), message.get("grounded_subgoal")))
        rows = np.zeros((CHUNK, 8))
        rows[:, :4] = self.frames, self.start, self.newest.mean(), self.inferences
        rows[:, 4] = np.arange(CHUNK)
        return {"actions": rows, "infer_time_ms": 0.1}


class ChallengeServer(WireServer):
    """Remembers how much it was shown; gives three rows."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.metadata = {"name": "submission", "version": "phase-1"}
        self.seen = 0

    def answer(self, message):
        if message.get("reset"):
            self.seen = 0
            return {"reset_finished": True}
        assert message["is_first_step"] == (self.seen == 0)
        assert isinstance(message["task_goal"], list)
        lengths = {len(value) for key, value in message.items() if key.endswith("_list")}
        assert len(lengths) == 1, lengths
        self.seen += lengths.pop()
        return {"actions": np.full((3, 8), float(self.seen))}


class VlaEvalServer(WireServer):
    """A model server of vla-eval: envelopes, texts as keys, one action per observation.

    `payloads` are the payloads it got, by type; an `answer` is the payload of an action. The faults
    "other-type", "other-number" and "late-error" change an envelope; a dictionary is the payload.
    """

    hello = {  # noqa: RUF012
        "harness_version": "0.8.0", "protocol_version": 1, "model_server": "Test",
        "capabilities": {},
    }  # fmt: skip

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.payloads = []
        self.step = 0

    def answer(self, message):
        self.step += 1
        return {"actions": np.full(8, self.step, np.float32)}

    async def _begin(self, websocket):
        """Say nothing: the client speaks first."""

    async def _converse(self, websocket):
        async for data in websocket:
            await self._respond(websocket, msgpack.unpackb(data, object_hook=decode_texts))

    async def _respond(self, websocket, message):
        assert set(message) == {"type", "payload", "seq", "timestamp"}
        kind = message["type"]
        number = message["seq"]
        self.payloads.append((kind, message["payload"]))
        if kind == "hello":
            await websocket.send(envelope("hello", self.hello, number))
        elif kind == "episode_start":
            self.step = 0
            if self.faults[:1] == ["late-error"]:
                await websocket.send(envelope("error", {"error": "cannot start"}, number))
        elif kind == "observation":
            fault = self.faults.pop(0) if self.faults else None
            await websocket.send(self._reply(message["payload"], number, fault))

    def _reply(self, shown, number, fault):
        if fault == "other-type":
            return envelope("hello", self.answer(shown), number)
        if fault == "other-number":
            return envelope("action", self.answer(shown), number + 1)
        if isinstance(fault, bytes) or fault == "text":
            return fault
        try:
            payload = fault if isinstance(fault, dict) else self.answer(shown)
        except Exception as error:  # noqa: BLE001
            return envelope("error", {"error": str(error)}, number)
        return envelope("action", payload, number)


def envelope(kind, payload, number):
    message = {"type": kind, "payload": payload, "seq": number, "timestamp": time.time()}
    return msgpack.packb(message, default=encode_texts)
