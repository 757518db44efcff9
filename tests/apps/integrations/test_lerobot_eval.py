"""The plugin in the real LeRobot: `make integrations` runs this with LeRobot's own environment."""

import json

import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here; run `make integrations`")
pytest.importorskip("lerobot_env_roboirg", reason="the plugin is not installed here")

from page_commands import check_versions, run_page
from replay_table import (
    MANY,
    MAX_STEPS,
    MESHES,
    PER_TASK,
    PLAYED,
    SETTING,
    TASKS,
    own_outcomes,
)

pytestmark = pytest.mark.sim

TASK = TASKS[0]
BATCHES = [(2, True), (4, False)]
if MANY:
    BATCHES = [(1, False), (2, False), (2, True), (8, False), (8, True)]


@pytest.fixture(scope="session")
def ours(checkpoint):
    """Outcomes of our own runner with the same checkpoint."""
    return [outcome[:3] for outcome in own_outcomes(f"lerobot://{checkpoint}")]


@pytest.mark.parametrize(("batch", "use_async"), BATCHES)
def test_the_page_s_commands_have_the_outcomes_of_our_runner(
    checkpoint, ours, tmp_path, batch, use_async
):
    """The page's commands are played by LeRobot with a checkpoint of recorded actions.

    Replaced are the checkpoint, tasks, setting, and how many episodes are played, and how many at a
    time. `ours` has the outcomes of our runner with the same checkpoint, which agree.
    """
    run_page(
        "LeRobot",
        tmp_path,
        {
            "lerobot/some-checkpoint": checkpoint,
            "PickXtimes,VideoUnmask": ",".join(PLAYED),
            "contextual": f"{SETTING} --env.discover_packages_path=replay_policy "
            f"--policy.device=cpu --env.meshes={MESHES} --env.cameras=front "
            f"--env.episode_length={MAX_STEPS} --eval.use_async_envs={str(use_async).lower()}",
            "n_episodes=50": f"n_episodes={PER_TASK}",
            "batch_size=8": f"batch_size={batch}",
        },
    )
    told = json.loads((tmp_path / "runs" / "lerobot" / "eval_info.json").read_text())
    found = [
        (task["task_group"], episode, success)
        for task in told["per_task"]
        for episode, success in enumerate(task["metrics"]["successes"])  # of the seeds from 1000 on
    ]
    expected = [(f"{task}-{SETTING}-test", *verdict) for task, *verdict in ours]

    assert sorted(found) == sorted(expected)


def test_the_page_names_the_version_that_is_played():
    check_versions("LeRobot")
