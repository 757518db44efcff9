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


def random_courses(task):
    """Yield 12 episodes of a task with random events, and the last step of each.

    StopCube's stages end by the time, so it goes on for 700 steps after the last event, others for
    20.
    """
    rng = np.random.default_rng(3)
    for index in range(12):
        episode = get_episode(task, "test", index)
        events = random_events(episode, rng)
        yield episode, events, events[-1].step + (700 if task == "StopCube" else 20)


def judged_step_by_step(episode, events, last_step):
    """Judge the facts of every single step.

    Returns the judge, the step of its verdict (the last one without any), and for each step the
    number of the stage that was due, from the policy's first one on (negative in the video).
    """
    judge = Judge.of(episode)
    due_stages = []
    verdict_steps = [last_step]
    for step, facts in enumerate(facts_by_step(events, last_step)):
        due_stages.append(judge.index - len(episode.demonstration))
        if judge.update(step, facts) is not Status.ONGOING:
            verdict_steps.append(step)
    return judge, min(verdict_steps), tuple(due_stages)


@pytest.mark.parametrize("task", all_tasks())
def test_judging_stored_events_gives_the_verdict_of_judging_every_step(task):
    """A record stores events only: which fact began or ceased to hold at which step. `rejudge` and
    `decide` skip the steps at which nothing can change. For random events they must find what the
    slow way, judging the facts of every single step, finds: the verdict, its step, and the stage
    that was due at each step."""
    for episode, events, last_step in random_courses(task):
        judge, verdict_step, due_stages = judged_step_by_step(episode, events, last_step)

        replay = rejudge(episode, events, policy_start_step=0, elapsed_steps=last_step)

        found = replay.judge
        assert (found.index, found.status, found.cause) == (judge.index, judge.status, judge.cause)
        assert replay.expected_stages == due_stages
        assert decide(episode, events, last_step).step == verdict_step


@pytest.mark.parametrize("task", all_tasks())
def test_the_fast_way_to_completed_stages_finds_those_of_a_whole_replay(task):
    """`completed_stages` returns which step completed each stage, ``{0: 40, 1: 95}``. `completions`
    of a replay reads the same, as pairs, from the stage that was due at each step. For random
    events both must agree."""
    for episode, events, last_step in random_courses(task):
        replay = rejudge(episode, events, policy_start_step=0, elapsed_steps=last_step)

        assert completed_stages(episode, events, last_step) == dict(replay.completions())
