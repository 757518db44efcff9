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


@pytest.fixture(scope="module")
def planner_that_stays_then_picks_up():
    """The record of an episode of the planner in own_planners.py of this folder."""
    return record_of_episode("planner:own_planners:StaysThenPicksUp")


@pytest.mark.sim
def test_scripted_hands_carry_out_the_subgoals_that_a_users_planner_names(
    planner_that_stays_then_picks_up,
):
    """A planner names subgoals, and scripted hands carry them out.

    This one names *remain static for 5 steps*, and from then on *pick up the container*. The hands
    refuse that, as it says not which container, and after five refusals the episode ends.
    """
    record = planner_that_stays_then_picks_up

    assert record.outcome == "failure", record.cause
    assert [(subgoal.text, subgoal.ended) for subgoal in record.subgoals] == [
        ("remain static for 5 steps", "done"),
        ("pick up the container", "refused"),
    ]
    assert record.usage["refused"] == 5


@pytest.mark.sim
def test_a_users_planner_runs_in_a_process_without_the_world(planner_that_stays_then_picks_up):
    """The planner reports the number of its process, and whether it finds an object of the
    simulator in the memory of this process ("world").
    """
    record = planner_that_stays_then_picks_up

    assert read_policy(record.policy).is_hosted
    assert record.usage["process"] != os.getpid()
    assert record.policy_metadata["planner"] == {"world": False}


@pytest.mark.sim
def test_a_users_planner_gets_a_picture_for_each_subgoal_and_learns_how_each_ended(
    planner_that_stays_then_picks_up,
):
    """The planner names *remain static*, which is done, and then another subgoal five times, which
    is refused each time.

    So it was asked six times, each time with a picture, and learned five ends: one done, and four
    refused (after the fifth refusal the episode is over). No end names a thing that was handled.
    """
    counted = planner_that_stays_then_picks_up.usage

    assert counted["pictures"] == 6
    assert counted["ends"] == 5
    assert counted["named"] == 0


@pytest.mark.sim
def test_a_users_planner_with_scripted_hands_is_privileged_and_has_the_version_of_both(
    planner_that_stays_then_picks_up,
):
    """Privileged means that it reads the simulator's state, as the hands do. The planner's own
    version is mine-1.

    A policy that is only looked up is described as in the record of an episode that it played.
    """
    record = planner_that_stays_then_picks_up

    looked_up = open_policy(read_policy("planner:own_planners:StaysThenPicksUp"))

    assert record.policy_version == looked_up.version == "mine-1 + scripted hands"
    assert record.privileged is looked_up.is_privileged is True


@pytest.mark.sim
def test_a_planner_that_ends_its_process_loses_its_own_episode_as_an_error_of_the_policy():
    result = record_of_episode("planner:own_planners:EndsItsProcess")
    assert (result.outcome, result.error) == ("error", "policy")


@pytest.mark.sim
def test_a_planner_that_is_declared_privileged_runs_in_the_process_of_the_world():
    """AsksForTheWorld has a method attach(env), so it may read the simulator.

    The prefix `privileged:` allows it. It reports the number of its process, which is that of the
    simulator: this one.
    """
    spec = "privileged:planner:own_planners:AsksForTheWorld"

    record = record_of_episode(spec)

    assert not read_policy(spec).is_hosted
    assert record.usage["process"] == os.getpid()


def test_a_planner_that_needs_the_world_is_refused_if_not_declared_privileged():
    """AsksForTheWorld has a method attach(env): unmarked, it could read the goal unnoticed."""
    with pytest.raises(InvalidValueError, match="has attach"):
        make_policy("planner:own_planners:AsksForTheWorld", 0)


@pytest.mark.sim
def test_without_processes_for_policies_a_planner_runs_in_the_process_of_the_world():
    """An EpisodeRunner without `hosts` starts no process for a policy. The planner reports the
    number of its process, and names the same two subgoals as elsewhere.
    """
    spec = "planner:own_planners:StaysThenPicksUp"

    record, _ = EpisodeRunner(Path()).play_once(job_of(spec))

    assert record.usage["process"] == os.getpid()
    assert len(record.subgoals) == 2
    assert record.policy_version == "mine-1 + scripted hands"


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
    """The planners are in own_planners.py of this folder: one that needs the simulator, none of
    that name, one without a method plan(), and one that takes no options.
    """
    with pytest.raises(InvalidValueError, match=re.escape(words)):
        open_policy(read_policy(spec))
