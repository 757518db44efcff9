"""The same work on many things, in processes of their own."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from roboirg.core.errors import InvalidValueError, RoboIRGError

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


def parallel_map(
    work: Callable[[Item], Outcome], items: Sequence[Item], workers: int
) -> Iterator[tuple[Item, Outcome]]:
    """Every item with what the work on it gives, as they end.

    Args:
        work: a function that can be pickled.
        items: what it is called with.
        workers: how many processes; 0 works in this one.

    Raises:
        InvalidValueError: a negative number of workers.
        RoboIRGError: a process died.
    """
    if workers < 0:
        raise InvalidValueError(f"workers is {workers}; it must be at least 0.")
    if workers == 0:
        yield from ((item, work(item)) for item in items)
        return
    pool = ProcessPoolExecutor(
        workers,
        # Spawned, not forked: threads of the simulator do not survive a fork.
        mp_context=multiprocessing.get_context("spawn"),
        initializer=signal.signal,
        # Ctrl-C reaches the whole process group; the parent decides what it means.
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    with contextlib.ExitStack() as stack:
        stack.callback(pool.shutdown, cancel_futures=True)
        futures = {pool.submit(work, item): item for item in items}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise RoboIRGError(f"A process at work died: {error}") from error
