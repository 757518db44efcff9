"""Policies that cheat, or break what they can reach."""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import gc
import os
import signal
import socket
import sys
import threading
import time
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from msgspec.msgpack import Ext, encode

from roboirg.runs.hosting.messages import receive_call, send

NEEDLE = "9035768"
"""Stands in the world's secret, read backward; this file does not hold it."""


class Hostile:
    cameras = ()
    version = "1"

    def reset(self, instruction, demonstration):
        self.metadata = {}

    def act(self, observation):
        return -np.ones((24, 8))


class Searcher(Hostile):
    """Looks for the goal in every frame and every object."""

    def reset(self, instruction, demonstration):
        types = set()
        texts = set()
        frames = [*sys._current_frames().values()]
        while frames:
            frame = frames.pop()
            types |= {type(value).__name__ for value in frame.f_locals.values()}
            texts |= {value for value in frame.f_locals.values() if isinstance(value, str)}
            frames += [frame.f_back] if frame.f_back else []
        for thing in gc.get_objects():
            types.add(type(thing).__name__)
            if issubclass(type(thing), dict | list | tuple | set):
                values = thing.values() if isinstance(thing, dict) else thing
                # What changes meanwhile, and proxies of what is gone.
                with contextlib.suppress(RuntimeError, ReferenceError):
                    texts |= {value for value in values if issubclass(type(value), str)}
        self.metadata = {
            "world": "FakeWorld" in types,
            "job": "Job" in types,
            "goal": any(NEEDLE[::-1] in text for text in texts),
        }


class Patcher(Hostile):
    """Makes every episode a success."""

    def act(self, observation):
        from roboirg.judging import Judge
        from roboirg.records import record

        patched = record.Record
        patched.record_status = lambda self, *_: setattr(self, "outcome", "success")
        judge = Judge
        judge.status = "success"
        return super().act(observation)


class Leaker(Hostile):
    """Leaves a thread that spoils what comes after it."""

    def act(self, observation):
        def spoil():
            while True:
                time.sleep(0.001)
                np.random.seed(0)  # noqa: NPY002
                os.chdir("/")
                sys.modules.pop("hosting_fakes", None)
                os.environ["ROBOIRG_CACHE"] = "/nonexistent"

        threading.Thread(target=spoil).start()
        return super().act(observation)


class Wanderer(Hostile):
    def act(self, observation):
        self.metadata["before"] = os.getcwd()  # noqa: PTH109
        os.chdir("/")
        return super().act(observation)


class Closer(Hostile):
    def act(self, observation):
        os.closerange(0, 4096)
        return super().act(observation)


class Babbler(Hostile):
    """Sends something else than a reply, over every socket that it finds."""

    def act(self, observation):
        for descriptor in range(3, 256):
            with contextlib.suppress(OSError):
                socket.socket(fileno=os.dup(descriptor)).send(b"\0\0\0\x08cos\nsyst")
        return super().act(observation)


class Interrupter(Hostile):
    def act(self, observation):
        raise KeyboardInterrupt


class Unspeakable(Hostile):
    def act(self, observation):
        class BrokenError(Exception):
            def __str__(self):
                raise KeyboardInterrupt

        raise BrokenError


class Surrogate(Hostile):
    def act(self, observation):
        raise ValueError("\ud800" * 3)


class SurrogateMetadata(Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {"\ud800": "\ud800"}


class Debtor(Hostile):
    def usage(self):
        return {"cost_usd": -1e300, "calls": 1e308, "input_tokens": 5.0}


class Printer(Hostile):
    def act(self, observation):
        for _ in range(131):
            print("x" * 1_000_000)  # noqa: T201
        return super().act(observation)


class Wordy(Hostile):
    def act(self, observation):
        raise ValueError("x" * 100_000_000)


class Renderless(Hostile):
    def act(self, observation):
        from roboirg.core.errors import RenderDeviceError

        raise RenderDeviceError("No device.")


class Forger(Hostile):
    """Sends a message of its own instead of the reply."""

    message: Any = None

    def act(self, observation):
        send(line_to_world(), self.message)
        time.sleep(3600)


def host_process():
    """Return the object that carries out the calls of this process, from within a call."""
    frame = sys._getframe()
    while not hasattr(frame.f_locals.get("self"), "_under_way"):
        frame = frame.f_back
    return frame.f_locals["self"]


def line_to_world():
    """Return the line to the world of the episode whose call is under way."""
    return host_process()._under_way[0].line


class ForgesReply(Forger):
    """Says what only the supervisor may say: play this episode again."""

    message: ClassVar = {"type": "reply", "kind": "infrastructure", "message": "x", "again": True}


class ForgesKind(Forger):
    message: ClassVar = {"type": "outcome", "error": "infrastructure", "message": "x"}


class ForgesTurn(Forger):
    """Begins another call while one is under way."""

    message: ClassVar = {"type": "begun"}


class LyingArray(Forger):
    """An array of objects that exists nowhere."""

    message: ClassVar = {"type": "outcome", "rows": Ext(1, encode(("|O8", (2**40, 2**20))))}


class AnswersTwice(Forger):
    """Sends a second outcome, which would be taken for that of the next call."""

    def act(self, observation):
        send(line_to_world(), {"type": "outcome"})
        return -np.ones((12, 8))


class Announcer(Hostile):
    """Announces more than there is memory, and sends nothing of it."""

    data: ClassVar = (2**62).to_bytes(8, "big")

    def act(self, observation):
        line_to_world().sendall(self.data)
        time.sleep(3600)


class Deep(Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {}
        for _ in range(300):
            self.metadata = {"deeper": self.metadata}


class Umlauts(Hostile):
    """Does nothing wrong: its metadata are long only where escapes are counted."""

    def reset(self, instruction, demonstration):
        self.metadata = {"text": "ä" * 60_000}


class NamesServer(Hostile):
    def reset(self, instruction, demonstration):
        self.metadata = {"server": "localhost:1", "version": "2"}


class Asker(Hostile):
    """Asks for nothing, as often as it may, and at the end too."""

    def act(self, observation):
        for _ in range(63):
            self.ask()
        return super().act(observation)

    def close(self):
        self.ask()

    def ask(self):
        line = line_to_world()
        send(line, {"type": "question"})
        receive_call(line)


class Pesterer(Asker):
    """Keeps its world busy, which is nobody's time."""

    def act(self, observation):
        while True:
            self.ask()


class Forker(Hostile):
    """Leaves a process that no group, session or parent leads to, with everything open."""

    def act(self, observation):
        if (child := os.fork()) == 0:
            os.setsid()
            if os.fork() == 0:
                Path(os.environ["HOSTILE_NOTES"], str(os.getpid())).touch()
                time.sleep(3600)
            os._exit(0)
        os.waitpid(child, 0)
        while not any(Path(os.environ["HOSTILE_NOTES"]).iterdir()):
            time.sleep(0.01)
        return super().act(observation)


class GuardStopper(Forker):
    """Stops the process that would end what it leaves."""

    def act(self, observation):
        actions = super().act(observation)
        os.kill(os.getppid(), signal.SIGSTOP)
        return actions


class Chain(Hostile):
    """Leaves a process that starts the next one and exits, again and again; they hold a lock."""

    def act(self, observation):
        lock = Path(os.environ["HOSTILE_NOTES"], "lock").open("w")  # noqa: SIM115 - theirs
        fcntl.flock(lock, fcntl.LOCK_EX)
        if os.fork() == 0:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            while True:
                os.setsid()
                if os.fork():
                    os._exit(0)
        return super().act(observation)


class OutOfMemory(Forker):
    """Is killed as the kernel kills for memory, and leaves a process whose name is no text."""

    def act(self, observation):
        ctypes.CDLL(None).prctl(
            15, b"\xff) R 1\n(\xfe"
        )  # the name of this process and its children
        super().act(observation)
        os.kill(os.getpid(), signal.SIGKILL)


class Aborter(Forker):
    def act(self, observation):
        super().act(observation)
        os.abort()


class Turncoat(Hostile):
    """Becomes privileged where only its own process sees it."""

    if any("host_process" in word for word in sys.orig_argv):

        def attach(self, env):
            env.total = 1e9


class LateTurncoat(Hostile):
    def __init__(self):
        self.attach = print


FORGED = {
    "ForgesReply": "policy: the process sent no valid reply (Invalid value 'reply' - ",
    "ForgesKind": "policy: the process sent no valid reply (Invalid enum value 'infrastructure",
    "ForgesTurn": "policy: the process sent no valid reply (a message that was not asked for)",
    "AnswersTwice": "policy: the process sent no valid reply (a message ",
    "Announcer": "policy: the process sent no valid reply (a message of 4,611,686,018,",
    "LyingArray": "policy: the process sent no valid reply (Expected `bytes`, got `ext` - at ",
    "Pesterer": "policy: the process sent no valid reply (it asked for the video again and again)",
    "Deep": "policy: the policy's metadata are nested more than 16 deep; make them flat.",
    "NamesServer": "policy: the policy's metadata have the key 'server', which is reserved; ",
    "Aborter": "policy: the process died of signal 6 (Aborted) in the policy's act()",
    "LateTurncoat": "policy: Policy 'hostile_policies:LateTurncoat' has attach(), with which",
    "Turncoat": "policy: Policy 'hostile_policies:Turncoat' has attach(), with which",
}
"""Those that send what they must not, and how the cause of their errors begins."""
SPOILED = {
    "Closer": "policy: the process",
    "Babbler": "policy: the ",
    "Interrupter": "policy: KeyboardInterrupt",
    "Unspeakable": "policy: BrokenError: its text cannot be read",
    "Surrogate": "policy: ValueError: ???",
    "SurrogateMetadata": "policy: the policy's metadata hold text with lone surrogates.",
    "Wordy": "policy: ValueError: xxxx",
    "Renderless": "policy: No device.",
}
"""Those whose episodes end in an error, and how its cause begins."""
HARMLESS = (
    "Searcher",
    "Patcher",
    "Leaker",
    "Wanderer",
    "Printer",
    "Debtor",
)
"""Those that fail like any policy that does not do the task."""

SPEC = f"{Path(__file__).stem}:{{}}".format
