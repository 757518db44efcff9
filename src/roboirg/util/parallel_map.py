"""Parallel map: call a function on many items in worker processes."""

from __future__ import annotations

import contextlib
import functools
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NamedTuple, TypeVar, cast

from roboirg.core.errors import RoboIRGError
from roboirg.util.child_process import ChildExit, ChildProcess, serve

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

MOST_SHOWN = 120
"""Characters of the item at which a process died; a scene has thousands."""


class _Assigned(NamedTuple, Generic[Item]):
    """A child, and the item with which it calls the function."""

    child: ChildProcess
    item: Item


class _Reply(NamedTuple):
    """What a call came to: its outcome, or the error that it raised."""

    outcome: Any
    error: Exception | None = None


def parallel_map(
    work: Callable[[Item], Outcome], items: Sequence[Item], workers: int
) -> Iterator[tuple[Item, Outcome]]:
    """Yield every item with the result of its call, in the order in which the calls finish.

    An error of a call is raised here, and ends the other processes; so does closing the iterator.

    Args:
        work: a function that can be pickled.
        items: its arguments, one for each call.
        workers: number of processes; 0 runs all calls in this process, in order.

    Raises:
        RoboIRGError: a process died.
    """
    if workers == 0:
        for item in items:
            yield item, work(item)
        return
    waiting = deque(items)
    busy: dict[Connection, _Assigned[Item]] = {}

    def assign(child: ChildProcess) -> None:
        """Send the next item to a process."""
        item = waiting.popleft()
        busy[child.connection] = _Assigned(child, item)
        child.send(item)

    with contextlib.ExitStack() as stack:
        for _ in range(min(workers, len(items))):
            child = ChildProcess.spawn(_work, work)
            stack.callback(child.end)
            assign(child)
        while busy:
            for connection in cast("list[Connection]", wait(list(busy))):
                child, item = busy.pop(connection)
                outcome = _result(child, item)
                if waiting:
                    assign(child)
                yield item, outcome


def _result(child: ChildProcess, item: object) -> Any:  # noqa: ANN401 - of the function
    """Return the result of a call that has ended; raise what it raised.

    Raises:
        RoboIRGError: the process died.
    """
    reply = child.receive()
    if isinstance(reply, ChildExit):
        shown = repr(item)[:MOST_SHOWN]
        raise RoboIRGError(f"A worker process died at {shown}: {reply}.")
    if reply.error is not None:
        raise reply.error
    return reply.outcome


def _work(connection: Connection, work: Callable[[Item], Outcome]) -> None:
    """Call the function with every item that comes; runs in a child."""
    serve(connection, functools.partial(_call, work))


def _call(work: Callable[[Item], Outcome], item: Item) -> _Reply:
    """Call the function with an item."""
    try:
        return _Reply(work(item))
    except Exception as error:  # noqa: BLE001 - raised again by the parent
        error.add_note(traceback.format_exc())
        return _Reply(None, error)
