"""What a dry run counts: episodes, and the calls of models that they take at least."""

import pytest
from msgspec.structs import replace

from roboirg.policies.by_name.finding import read_policy
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.plan_counts import cell_sizes, least_calls

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


def pick_x_times_jobs(spec):
    """Return the explicit test episodes 0, 1 and 2 of PickXtimes, to be played by *mine*.

    Args:
        spec: of the policy *mine*, which need not be installed.
    """
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
    """To pick a cube n times takes n pick-ups, n times putting it down, and a press of the button:
    2n + 1 subgoals, for each of which a planner asks its model.

    The three episodes ask for 3, 1 and 1 repetitions. Counts are by policy (*mine*) and setting.
    """
    calls = least_calls(pick_x_times_jobs(spec))

    assert calls == {("mine", "explicit"): 7 + 3 + 3}


def test_a_listener_calls_its_model_once_an_episode():
    """There are three episodes; counts are by policy and setting."""
    jobs = pick_x_times_jobs(f"vlm-listener:openai?{MODEL_SERVER}&pictures=no")

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
    """The oracle and *random* have no model; that of a server or of a planner of the user's is not
    seen from here.
    """
    assert least_calls(pick_x_times_jobs(spec)) == {}
