"""Watches a run that stops when what it compares is decided."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace

from roboirg.records.record import Job
from roboirg.records.record_codec import identity_key
from roboirg.records.store import RecordStore
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.stopping import find_stopping, scene_of
from roboirg.runs.run.progress import Reporter


class StopWatch:
    """Looks at the results of a run after every scene, and drops the jobs that need no playing.

    What it finds depends on the plan and the stored results alone.

    Args:
        plan: with a stop rule.
        jobs: of the plan.
        store: with the results so far.
        reporter: gets what was found after every look.

    Attributes:
        unneeded: jobs that are not in the queue now.

    Raises:
        InvalidValueError: the plan has nothing to compare.
    """

    def __init__(
        self, plan: Plan, jobs: Iterable[Job], store: RecordStore, reporter: Reporter
    ) -> None:
        self._store = store
        self._reporter = reporter
        self._found = find_stopping(plan, jobs, store.stored.values())
        self.unneeded: list[Job] = []
        reporter.compare(self._found)

    def in_order(self, jobs: Iterable[Job]) -> list[Job]:
        """Return the jobs that are needed, scene by scene in the order of looks; keep the others.

        They are needed after all if an episode is played again that had ended in an error, and its
        result opens a comparison once more.
        """
        places = self._found.places
        needed = []
        unneeded = []
        for job in (*jobs, *self.unneeded):
            if self._found.needs(job):
                needed.append(job)
            else:
                unneeded.append(job)
        self.unneeded = unneeded
        return sorted(needed, key=lambda job: places[scene_of(job)])

    def give_up(self) -> None:
        """Play nothing more that is not queued, as a side cannot be reached."""
        self.unneeded = []

    def look(self, queue: deque[Job], job: Job) -> None:
        """Look at the results after one more job, and leave what is needed now in the queue.

        Args:
            queue: changed in place, as the executor takes its next job from it.
            job: whose result was just stored.
        """
        open_places = [
            decision.places for decision in self._found.decisions if decision.finding == "open"
        ]
        # A result of any later scene changes nothing before the next scene is complete.
        place = self._found.places[scene_of(job)]
        if place > min(open_places, default=place):
            return
        found = replace(self._found, results=dict(self._store.stored))
        if found.decisions == self._found.decisions:
            return
        self._found = found
        needed = self.in_order(queue)
        queue.clear()
        queue.extend(needed)
        self._reporter.compare(found)

    def spared(self, jobs: Sequence[Job]) -> int:
        """Return how many jobs have no result and need none."""
        spared = 0
        for job in jobs:
            if identity_key(job) not in self._store.stored and not self._found.needs(job):
                spared += 1
        return spared
