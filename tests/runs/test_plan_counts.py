"""What a dry run counts: episodes, and the calls of models that they take at least."""

from msgspec.structs import replace

from roboirg.policies.by_name.finding import read_policy
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.plan_counts import cell_sizes, least_calls
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

MODEL_SERVER = "model=x&base_url=http://localhost:1/v1"


def test_a_dry_run_counts_episodes_by_policy_task_setting_and_form():
    plan = make_plan(
        ["random"], tasks="PickXtimes,StopCube", forms="implicit,resolved", episodes="3"
    )
    sizes = cell_sizes(plan.jobs())
    assert sizes["random", "StopCube"]["direct"] == {"implicit": 3, "resolved": 3}
    assert sizes["random", "StopCube"]["explicit"] == {"implicit": 3}
    assert "spatial" not in sizes["random", "StopCube"]

    total = sum(count for cell in sizes.values() for forms in cell.values() for count in
                forms.values())  # fmt: skip
    assert total == len(plan.jobs())


def test_a_dry_run_counts_the_least_calls_of_a_model_that_each_policy_makes():
    """A planner asks a model at least once for each subgoal, a listener once an episode.

    Policies without a model, with one elsewhere or of unknown code are not counted.
    """
    tasks = "PickXtimes,VideoUnmask"
    plan = make_plan(["random"], tasks=tasks, settings="explicit", episodes="3")
    specs = {
        "plans": f"planner:stateless?{MODEL_SERVER}",
        "paper's": "system:GroundSG-QwenVL?server=localhost:1",
        "other hands": f"planner:qwen?{MODEL_SERVER}&hands=not_there:Hands",
        "listens": f"vlm-listener:openai?{MODEL_SERVER}&pictures=no",
        "knows": "planner:oracle",
        "own": "privileged:planner:not_there:Planner",
        "served": "openpi://localhost:1",
        "without": "system:pi0.5",
        "blind": "random",
    }
    jobs = [replace(job, policy=name, ref=read_policy(spec)) for name, spec in specs.items()
            for job in plan.jobs()]  # fmt: skip
    episodes = [get_episode(task, "test", index) for task in tasks.split(",") for index in range(3)]

    subgoals = sum(
        len(get_task(episode.task).stages(episode.scene, episode.goal)) for episode in episodes
    )

    assert subgoals > len(episodes)
    assert least_calls(jobs) == {
        ("plans", "explicit"): subgoals,
        ("paper's", "explicit"): subgoals,
        ("other hands", "explicit"): subgoals,
        ("listens", "explicit"): len(episodes),
    }
