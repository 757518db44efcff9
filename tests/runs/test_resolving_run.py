"""A policy behind a rewriter, played by a run: each part where it belongs."""

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

SPEC = "resolve:listener?policy=test_resolving_run:KeepsWords"


class KeepsWords:
    """Holds still, and reports where it is and what it has heard."""

    cameras = ()
    version = "v7"

    def reset(self, instruction, demonstration):
        self.metadata = {"process": os.getpid(), "heard": instruction}

    def act(self, observation):
        self.metadata["seen"] = observation["instruction"]
        return np.append(observation["joint_positions"], 1.0)


@pytest.mark.sim
def test_a_users_policy_behind_a_rewriter_has_a_process_of_its_own_and_hears_the_explicit_command():
    """The job asks in the setting *direct*, but a rewriter states the explicit command instead.

    The user's policy notes in its metadata what it heard and in which process. The version is
    *built-in* for the rewriter and *v7* for the policy; only a rewriter that knows the declared
    meaning makes the pair privileged.
    """
    job = Job(
        policy=SPEC,
        ref=open_policy(read_policy(SPEC)),
        task="PickXtimes",
        split="test",
        episode=0,
        environment=EnvironmentOptions(max_steps=5),
        options=InstructionOptions("direct"),
    )

    with HostPool(HostSettings()) as pool, pool.connect() as line:
        record = EpisodeRunner(Path(), hosts=line).play_once(job).record

    assert record.outcome == "failure", record.details
    explicit = instruct(get_episode("PickXtimes", "test", 0)).text
    assert record.policy_metadata["policy"]["heard"] == explicit
    assert record.policy_metadata["policy"]["process"] != os.getpid()
    assert record.usage["resolved"] == 1.0
    # Known before the run, and the same in the record.
    assert job.ref.version == record.policy_version == "built-in → v7"
    assert job.ref.is_privileged, "its namer knows the declared meaning"
    assert not read_policy(SPEC.replace("listener", "surface")).is_privileged
