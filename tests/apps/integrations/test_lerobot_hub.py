"""The Hub's file in the real LeRobot 0.4: `make integrations` runs this in its environment."""

import importlib.metadata

import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here; run `make integrations`")
if not importlib.metadata.version("lerobot").startswith("0.4."):
    pytest.skip("this is for LeRobot 0.4", allow_module_level=True)

from page_commands import ROOT, blocks, check_versions, read_verdicts, replaced, run_page
from replay_table import MANY, MAX_STEPS, MESHES, in_batches_of

pytestmark = pytest.mark.sim

BATCHES = [(2, False), (2, True)]
if MANY:
    BATCHES = [(1, False), (2, False), (2, True), (8, False), (8, True)]


@pytest.fixture
def hub(tmp_path):
    """A cache as the Hub's client leaves it after the download of `env.py`."""
    repository = tmp_path / "hub" / "models--org--repo"
    commit = "0" * 40
    (repository / "snapshots" / commit).mkdir(parents=True)
    (repository / "refs").mkdir()
    (repository / "refs" / "commit").write_text(commit)
    source = ROOT / "integrations" / "lerobot_env_roboirg" / "env.py"
    (repository / "snapshots" / commit / "env.py").write_bytes(source.read_bytes())
    return tmp_path / "hub"


@pytest.fixture(params=BATCHES)
def played_by_lerobot(checkpoint, hub, request, tmp_path):
    """What LeRobot 0.4 says of the page's program, played offline: (task, episode, success).

    The checkpoint, which plays recorded actions, and the episodes are put into the program, and
    how many are played at a time, in processes of their own or not; `import replay_checkpoint`
    makes the checkpoint's type known to LeRobot.
    """
    batch, use_async = request.param
    options = {"cameras": ["front"], "meshes": MESHES, "max_steps": MAX_STEPS}
    values = {
        "import json\n": "import json\nimport replay_checkpoint\n",
        "lerobot/some-checkpoint": checkpoint,
        **in_batches_of(batch),
        "json.dumps(told)": f"json.dumps(told | {options})",
        "use_async_envs=False": f"use_async_envs={use_async}",
    }
    (program,) = blocks("LeRobot 0.4", "python")
    (tmp_path / "play_hub.py").write_text(replaced(program, values))
    run_page("LeRobot 0.4", tmp_path, {}, HF_HUB_CACHE=str(hub), HF_HUB_OFFLINE="1")
    return [
        (verdict["task"], verdict["episode"], verdict["success"])
        for verdict in read_verdicts(tmp_path)
    ]


def test_lerobot_and_our_runner_agree_on_success_of_each_episode(played_by_lerobot, ours):
    """`played_by_lerobot` is of the documented program with a checkpoint that plays recorded
    actions, some of them cut short, so that some episodes fail.

    `ours` are outcomes of our runner with the same actions in the same episodes. LeRobot's results
    have no steps.
    """
    expected = [(task, episode, success) for task, episode, success, _steps in ours]

    assert sorted(played_by_lerobot) == sorted(expected)


def test_the_page_names_the_version_that_is_played():
    check_versions("LeRobot 0.4")
