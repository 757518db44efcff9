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
    own_outcomes,
)

pytestmark = pytest.mark.sim

BATCHES = [(2, True), (4, False)]
if MANY:
    BATCHES = [(1, False), (2, False), (2, True), (8, False), (8, True)]


@pytest.fixture(scope="session")
def ours(checkpoint):
    """Outcomes of our own runner with the same checkpoint."""
    return own_outcomes(f"lerobot://{checkpoint}")


@pytest.fixture(params=BATCHES)
def played_by_lerobot(checkpoint, request, tmp_path):
    """What LeRobot says of the page's command: (group of tasks, episode, success).

    The checkpoint, which plays recorded actions, and the episodes are put into the command, and
    how many are played at a time, in processes of their own or not. The page leaves out options of
    the environment; here they follow the setting.
    """
    batch, use_async = request.param
    options = (
        f"{SETTING} --env.discover_packages_path=replay_policy --policy.device=cpu "
        f"--env.meshes={MESHES} --env.cameras=front --env.episode_length={MAX_STEPS} "
        f"--eval.use_async_envs={str(use_async).lower()}"
    )
    values = {
        "lerobot/some-checkpoint": checkpoint,
        "PickXtimes,VideoUnmask": ",".join(PLAYED),
        "contextual": options,
        "n_episodes=50": f"n_episodes={PER_TASK}",
        "batch_size=8": f"batch_size={batch}",
    }
    run_page("LeRobot", tmp_path, values)
    told = json.loads((tmp_path / "runs" / "lerobot" / "eval_info.json").read_text())
    played = []
    for task in told["per_task"]:
        for episode, success in enumerate(task["metrics"]["successes"]):  # of seeds from 1000 on
            played.append((task["task_group"], episode, success))
    return played


def test_lerobot_and_our_runner_agree_on_success_of_each_episode(played_by_lerobot, ours):
    """`played_by_lerobot` is of the documented command with a checkpoint that plays recorded
    actions, some of them cut short, so that some episodes fail.

    `ours` are outcomes of our runner with the same checkpoint in the same episodes. LeRobot's name
    of a task also has the setting and the split; its results have no steps.
    """
    expected = [
        (f"{task}-contextual-test", episode, success) for task, episode, success, _steps in ours
    ]
    assert sorted(played_by_lerobot) == sorted(expected)


def test_the_page_names_the_version_that_is_played():
    check_versions("LeRobot")
