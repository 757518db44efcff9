"""What a dry run counts: episodes, and the calls of models that they take at least."""

import pytest
from msgspec.structs import replace

from roboirg.policies.by_name.finding import read_policy
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.plan_counts import cell_sizes, least_calls
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

MODEL_SERVER = "model=x&base_url=http://localhost:1/v1"


def test_a_dry_run_counts_episodes_by_policy_task_setting_and_form():
    """Explicit instructions have one form, and StopCube has no spatial ones."""
    plan = make_plan(["random"], tasks="StopCube", forms="implicit,resolved", episodes="3")

    sizes = cell_sizes(plan.jobs())

    assert sizes["random", "StopCube"] == {
        "explicit": {"implicit": 3},
        "direct": {"implicit": 3, "resolved": 3},
        "reasoning": {"implicit": 3, "resolved": 3},
        "contextual": {"implicit": 3, "resolved": 3},
    }


def jobs_of(spec):
    """Return three explicit episodes of PickXtimes of a policy that need not be installed."""
    plan = make_plan(["random"], tasks="PickXtimes", settings="explicit", episodes="3")
    return [replace(job, policy="mine", ref=read_policy(spec)) for job in plan.jobs()]


@pytest.mark.parametrize(
    "spec",
    [
        f"planner:stateless?{MODEL_SERVER}",
        "system:GroundSG-QwenVL?server=localhost:1",
        f"planner:qwen?{MODEL_SERVER}&hands=not_there:Hands",
    ],
)
def test_a_planner_calls_its_model_at_least_once_for_each_subgoal(spec):
    """The stages of the task are what there is to do: picking up, putting down, again, ..."""
    stages = 0
    for index in range(3):
        episode = get_episode("PickXtimes", "test", index)
        stages += len(get_task("PickXtimes").stages(episode.scene, episode.goal))

    calls = least_calls(jobs_of(spec))

    assert stages > 3
    assert calls == {("mine", "explicit"): stages}


def test_a_listener_calls_its_model_once_an_episode():
    jobs = jobs_of(f"vlm-listener:openai?{MODEL_SERVER}&pictures=no")

    assert least_calls(jobs) == {("mine", "explicit"): 3}


@pytest.mark.parametrize(
    "spec",
    [
        "planner:oracle",
        "privileged:planner:not_there:Planner",
        "openpi://localhost:1",
        "system:pi0.5",
        "random",
    ],
)
def test_no_calls_are_counted_of_a_policy_whose_model_is_elsewhere_unknown_or_missing(spec):
    assert least_calls(jobs_of(spec)) == {}
