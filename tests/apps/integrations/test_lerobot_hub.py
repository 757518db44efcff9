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


@pytest.mark.parametrize(("batch", "use_async"), BATCHES)
def test_the_page_s_program_has_the_outcomes_of_our_runner(
    checkpoint, ours, hub, tmp_path, batch, use_async
):
    """The program of the page is written to a file and played with LeRobot 0.4, offline.

    Replaced are the checkpoint (by one that plays recorded actions, and is made known), sizes of
    batches, and what is written of each episode. `ours` are outcomes of our runner with the same
    actions, so tasks, episodes and successes agree.
    """
    values = {
        "import json\n": "import json\nimport replay_checkpoint\n",  # makes the policy known
        "lerobot/some-checkpoint": checkpoint,
        **in_batches_of(batch),
        "json.dumps(told)": f"json.dumps(told | {options()})",
        "use_async_envs=False": f"use_async_envs={use_async}",
    }
    (program,) = blocks("LeRobot 0.4", "python")
    (tmp_path / "play_hub.py").write_text(replaced(program, values))
    run_page("LeRobot 0.4", tmp_path, {}, HF_HUB_CACHE=str(hub), HF_HUB_OFFLINE="1")

    found = [
        (verdict["task"], verdict["episode"], verdict["success"])
        for verdict in read_verdicts(tmp_path)
    ]

    assert sorted(found) == sorted(outcome[:3] for outcome in ours)


def options():
    """The options of episodes that the program of the page should write with its verdicts."""
    return {"cameras": ["front"], "meshes": MESHES, "max_steps": MAX_STEPS}


def test_the_page_names_the_version_that_is_played():
    check_versions("LeRobot 0.4")
