"""A planner of the user's own has a process of its own; its scripted hands stay with the world."""

import os
import re
from pathlib import Path

import pytest

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.policies.by_name.finding import make_policy, read_policy
from roboirg.records.record import Job
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.play.rollout import EpisodeRunner


def job_of(spec):
    return Job(policy=spec, ref=read_policy(spec), task="VideoUnmask", split="test", episode=0,
              environment=EnvironmentOptions(60),
              options=InstructionOptions("explicit"))  # fmt: skip


def record_of_episode(spec):
    with HostPool(HostSettings()) as pool, pool.connect() as line:
        return EpisodeRunner(Path(), hosts=line).play_once(job_of(spec))[0]


@pytest.mark.sim
def test_a_users_planner_runs_in_a_process_without_the_world_and_gets_pictures_and_words():
    """A planner names subgoals, which scripted hands carry out; these do know the world.

    This one names *remain static* and then *pick up the container*, which hands refuse five times.
    """
    spec = "planner:own_planners:StaysThenPicksUp"
    assert read_policy(spec).is_hosted

    result = record_of_episode(spec)
    assert result.outcome == "failure", result.cause
    assert [(subgoal.text, subgoal.ended) for subgoal in result.subgoals] == [
        ("remain static for 5 steps", "done"),
        ("pick up the container", "refused"),
    ]

    spent = result.usage
    assert spent["process"] != os.getpid()
    # It learns how each subgoal ended, but for the last: one that was done, four refused.
    assert (spent["refused"], spent["named"], spent["ends"]) == (5, 0, 1 + 4)
    assert spent["pictures"] == 1 + 5  # one where it named the first, five before refusals
    assert result.policy_metadata["planner"] == {"world": False}

    # The whole is marked as it acts by the simulator's state, and described alike beforehand.
    known = open_policy(read_policy(spec))
    assert known.version == result.policy_version == "mine-1 + scripted hands"
    assert (known.is_privileged, result.privileged) == (True, True)


@pytest.mark.sim
def test_a_planner_that_ends_its_process_loses_its_own_episode_as_an_error_of_the_policy():
    result = record_of_episode("planner:own_planners:EndsItsProcess")
    assert (result.outcome, result.error) == ("error", "policy")


@pytest.mark.sim
def test_a_planner_that_needs_the_world_runs_next_to_it_only_if_declared_privileged():
    """It has a method attach(env). Would find one that reads the goal without being marked."""
    spec = "privileged:planner:own_planners:AsksForTheWorld"
    assert not read_policy(spec).is_hosted
    assert record_of_episode(spec).usage["process"] == os.getpid()

    # In a run whose policies share the worker's process, every planner runs there.
    shared = EpisodeRunner(Path()).play_once(job_of("planner:own_planners:StaysThenPicksUp"))[0]
    assert (shared.usage["process"], len(shared.subgoals)) == (os.getpid(), 2)
    assert shared.policy_version == "mine-1 + scripted hands"
    with pytest.raises(InvalidValueError, match="has attach"):
        make_policy("planner:own_planners:AsksForTheWorld", 0)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("planner:own_planners:AsksForTheWorld", "has attach()"),
        ("planner:own_planners:Nothing", "has no class 'Nothing'"),
        ("planner:own_planners:NoPlanner", "class NoPlanner has no method plan()"),
        (
            "planner:own_planners:StaysThenPicksUp?keep=2",
            "no option of planner:own_planners:StaysThenPicksUp",
        ),
    ],
)
def test_a_planner_that_cannot_be_used_is_refused_with_the_reason(spec, words):
    with pytest.raises(InvalidValueError, match=re.escape(words)):
        open_policy(read_policy(spec))
