"""Parallel map: call a function on many items in worker processes."""

from __future__ import annotations

import contextlib
import functools
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import TypeVar, cast

from roboirg.core.errors import RoboIRGError
from roboirg.util.child_process import ChildExit, ChildProcess, serve

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

MOST_SHOWN = 120
"""Characters of the item at which a process died; a scene has thousands."""


def parallel_map(
    work: Callable[[Item], Outcome], items: Sequence[Item], workers: int
) -> Iterator[tuple[Item, Outcome]]:
    """Yield every item with the result of its call, in the order in which the calls finish.

    Args:
        work: a function that can be pickled.
        items: its arguments, one for each call.
        workers: number of processes; 0 runs all calls in this process.
    """
    if workers == 0:
        yield from ((item, work(item)) for item in items)
        return
    waiting = deque(items)
    busy: dict[Connection, tuple[ChildProcess, Item]] = {}

    def assign(child: ChildProcess) -> None:
        item = waiting.popleft()
        busy[child.connection] = child, item
        child.send(item)

    with contextlib.ExitStack() as stack:
        for _ in range(min(workers, len(items))):
            child = ChildProcess.spawn(_work, work)
            stack.callback(child.end)
            assign(child)
        while busy:
            for connection in cast("list[Connection]", wait(list(busy))):
                child, item = busy.pop(connection)
                reply = child.receive()
                if isinstance(reply, ChildExit):
                    shown = repr(item)[:MOST_SHOWN]
                    raise RoboIRGError(f"A worker process died at {shown}: {reply}.")
                outcome, error = reply
                if error is not None:
                    raise error
                if waiting:
                    assign(child)
                yield item, outcome


def _work(connection: Connection, work: Callable[[Item], Outcome]) -> None:
    serve(connection, functools.partial(_call, work))


def _call(work: Callable[[Item], Outcome], item: Item) -> tuple[Outcome | None, Exception | None]:
    try:
        return work(item), None
    except Exception as error:  # noqa: BLE001 - raised again by the parent
        error.add_note(traceback.format_exc())
        return None, error
