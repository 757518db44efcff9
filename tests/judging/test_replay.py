"""Judging again from events skips evaluations without changing what a full evaluation finds."""

from __future__ import annotations

import numpy as np
import pytest
from staged import named_facts

from roboirg.core.conditions import facts_of
from roboirg.judging import Event, Judge, Status
from roboirg.judging.episode_replay import completed_stages, decide, facts_by_step, rejudge
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode


def random_events(episode, rng):
    """Return events of facts that the stages expect, in order, among any of those they name."""
    stages = (*episode.demonstration, *episode.stages)
    named = named_facts(stages)
    events = []
    step = 0
    held = set()
    for stage in stages:
        wanted = facts_of(stage.expects)
        if rng.random() < 0.05:
            wanted = (named[rng.integers(len(named))], *wanted)
        for fact in wanted:
            step += int(rng.integers(0, 30))
            if fact not in held:
                events.append(Event(step, fact, True))
                held.add(fact)
            step += stage.lasting + int(rng.integers(0, 3))
            if rng.random() < 0.8:
                events.append(Event(step, fact, False))
                held.discard(fact)
    return events


@pytest.mark.parametrize("task", all_tasks())
def test_judging_stored_events_gives_the_verdict_of_judging_every_step(task):
    """Records store events only, the beginnings and ends of facts; judging them again skips the
    steps without any. Here 12 episodes with random events are judged step by step, and then from
    the events: stage, verdict, cause and step of the verdict must be the same. StopCube's stages
    end by the time, so it goes on for 700 steps after the last event, others for 20."""
    rng = np.random.default_rng(3)
    for index in range(12):
        episode = get_episode(task, "test", index)
        events = random_events(episode, rng)
        last = events[-1].step + (700 if task == "StopCube" else 20)
        judge = Judge((*episode.demonstration, *episode.stages), episode.scene)
        due = []
        decided = [last]
        for step, facts in enumerate(facts_by_step(events, last)):
            due.append(judge.index - len(episode.demonstration))
            judge.update(step, facts)
            if judge.status is not Status.ONGOING:
                decided.append(step)

        replay = rejudge(episode, events, 0, last)

        assert replay.expected_stages == tuple(due)
        assert replay.judge.index == judge.index
        assert replay.judge.status == judge.status
        assert replay.judge.cause == judge.cause
        assert replay.judge.violation == judge.violation
        assert completed_stages(episode, events, last) == dict(replay.completions())
        assert decide(episode, events, last).step == min(decided)
