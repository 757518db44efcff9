"""A policy behind a rewriter, played by a run: each part where it belongs."""

import functools
import os
from pathlib import Path

import numpy as np
import pytest

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record import Job
from roboirg.runs.hosting.host_pool import HostPool, HostSettings
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.tasks.splits.splits import get_episode


class KeepsWords:
    """Holds still, and reports where it is and what it has heard."""

    cameras = ()
    version = "v7"

    def reset(self, instruction, demonstration):
        self.metadata = {"process": os.getpid(), "heard": instruction}

    def act(self, observation):
        self.metadata["seen"] = observation["instruction"]
        return np.append(observation["joint_positions"], 1.0)


@functools.cache
def record_of(policy):
    """Play five steps of PickXtimes test/0, told in the setting *direct*; return the record."""
    job = Job(
        policy=policy,
        ref=open_policy(read_policy(policy)),
        task="PickXtimes",
        split="test",
        episode=0,
        environment=EnvironmentOptions(max_steps=5),
        options=InstructionOptions("direct"),
    )
    with HostPool(HostSettings()) as pool, pool.connect() as line:
        return EpisodeRunner(Path(), hosts=line).play_once(job).record


@pytest.mark.sim
def test_a_users_policy_behind_a_rewriter_hears_the_explicit_command_in_a_process_of_its_own():
    """The episode, PickXtimes test/0, is told in the setting *direct*, which leaves much unsaid.

    A rewriter (`resolve:`) replaces its instruction with the explicit command for the same episode,
    and counts this. `KeepsWords` stands for the policy of a user behind it: it holds still for all
    five steps, so it fails, and reports as its metadata what it has heard and the id of its
    process, which must not be the one of this test.
    """
    record = record_of("resolve:listener?policy=test_resolving_run:KeepsWords")

    explicit_command = instruct(get_episode("PickXtimes", "test", 0), "explicit").text
    reported = record.policy_metadata["policy"]
    assert record.outcome == "failure", record.details
    assert record.usage["resolved"] == 1.0
    assert reported["heard"] == explicit_command
    assert reported["process"] != os.getpid()


@pytest.mark.sim
def test_a_policy_behind_a_rewriter_has_both_their_versions_in_the_plan_and_in_the_record():
    """The rewriter `listener` comes with the benchmark; `KeepsWords` declares the version *v7*.

    A plan opens the policy before it is played, to read its version; the record has the same.
    """
    policy = "resolve:listener?policy=test_resolving_run:KeepsWords"

    assert open_policy(read_policy(policy)).version == "built-in → v7"
    assert record_of(policy).policy_version == "built-in → v7"
