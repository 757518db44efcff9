"""Parallel map: call a function on many items in worker processes."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.util.child_process import exit_with_parent

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


def _start_worker(parent: int) -> None:
    """Prepare a worker: it ends when the parent is killed."""
    exit_with_parent(parent)
    # Ctrl-C reaches the whole process group; only the parent handles it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def parallel_map(
    work: Callable[[Item], Outcome], items: Sequence[Item], workers: int
) -> Iterator[tuple[Item, Outcome]]:
    """Yield every item with the result of its call, in the order in which the calls finish.

    Args:
        work: a function that can be pickled.
        items: its arguments, one for each call.
        workers: number of processes; 0 runs all calls in this process.

    Raises:
        InvalidValueError: a negative number of workers.
        RoboIRGError: a worker process died.
    """
    if workers < 0:
        raise InvalidValueError(f"workers is {workers}; it must be at least 0.")
    if workers == 0:
        yield from ((item, work(item)) for item in items)
        return
    pool = ProcessPoolExecutor(
        workers,
        # Spawn, because threads of the simulator do not survive a fork.
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_start_worker,
        initargs=(os.getpid(),),
    )
    with contextlib.ExitStack() as stack:
        stack.callback(pool.shutdown, cancel_futures=True)
        futures = {pool.submit(work, item): item for item in items}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise RoboIRGError(f"A worker process died: {error}") from error
