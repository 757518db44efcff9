"""A watch acts once for each deadline that passes."""

from __future__ import annotations

import threading

from roboirg.util.deadline_watch import DeadlineWatch


def test_a_watch_acts_once_for_each_deadline() -> None:
    acted = threading.Semaphore(0)
    with DeadlineWatch(acted.release) as watch:
        watch.begin(3600)
        assert watch.acted_after is None
        for _ in range(2):
            watch.begin(0.05)
            assert acted.acquire(timeout=60)
            assert watch.acted_after is not None
            assert watch.acted_after >= 0.05
        watch.acted_after = None
        watch.begin(3600)
        watch.begin(None)
    assert watch.acted_after is None
    assert not acted.acquire(blocking=False)
