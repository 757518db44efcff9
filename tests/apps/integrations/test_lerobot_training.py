"""The whole way of docs/training.md with LeRobot's own commands, small, and without downloads.

`make integrations` runs this with LeRobot's own environment.
"""

import json
import shutil

import numpy as np
import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here; run `make integrations`")
pytest.importorskip("lerobot_env_roboirg", reason="the plugin is not installed here")
pytest.importorskip("accelerate", reason="lerobot[training] is not installed here")

import torch
from lerobot.configs.policies import PreTrainedConfig
from lerobot.envs.factory import make_env_pre_post_processors
from lerobot.policies.factory import get_policy_class, make_pre_post_processors
from lerobot.scripts.lerobot_eval import rollout
from page_commands import check_versions, run_page

from roboirg.apps.integrations.lerobot.env_config import RoboIRGEnvConfig
from roboirg.envs.factory import make
from roboirg.policies import make_policy, play
from roboirg.records.store import read_records

pytestmark = pytest.mark.sim

TASK = "StopCube"
STEPS = 40
LAST = "checkpoints/last/pretrained_model"
SMALL = {
    "act": "--policy.dim_model=64 --policy.n_heads=4 --policy.dim_feedforward=128 "
    "--policy.chunk_size=20 --policy.n_action_steps=8 --policy.n_encoder_layers=1 "
    "--policy.n_vae_encoder_layers=1",
    "diffusion": "--policy.horizon=16 --policy.n_action_steps=8 --policy.down_dims=[32,64] "
    "--policy.num_train_timesteps=3",
    "vqbet": "--policy.n_vqvae_training_steps=2 --policy.gpt_n_layer=1 --policy.gpt_n_head=4 "
    "--policy.gpt_input_dim=64 --policy.gpt_output_dim=64 --policy.gpt_hidden_dim=64",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder in which the page's commands have run, small."""
    root = tmp_path_factory.mktemp("training")
    values = {
        "--tasks PickXtimes": f"--tasks {TASK}",
        "--episodes 100": "--episodes 2",
        "--env.task=PickXtimes": f"--env.task={TASK} --env.episode_length={STEPS}",
        "--episodes 50": f"--episodes 2 --max-steps {STEPS}",
        "--eval.n_episodes=50": "--eval.n_episodes=2",
        "--policy.device=cuda": "--policy.device=cpu",
        "?device=cuda": "",
        "--batch_size=64 --steps=20000": "--batch_size=2 --steps=4 --num_workers=0",
        **{f"--policy.type={kind}": f"--policy.type={kind} {SMALL[kind]}" for kind in SMALL},
    }
    run_page(None, root, values, page="training.md", HF_HUB_OFFLINE="1")
    return root


def test_the_page_s_commands_have_equal_outcomes(folder):
    """The page's commands trained ACT and played two episodes by lerobot-eval and by `roboirg run`.

    `folder` has run them with smaller networks and fewer steps. Both have the same successes.
    """
    told = json.loads((folder / "runs" / "eval" / "eval_info.json").read_text())
    (theirs,) = [task["metrics"]["successes"] for task in told["per_task"]]

    ours = sorted(
        (record.episode, record.outcome) for record in read_records(folder / "runs" / "act")
    )

    assert ours == [(index, "success" if won else "failure") for index, won in enumerate(theirs)]
    assert len(ours) == 2


def test_the_page_names_the_version_that_is_played():
    check_versions(None, page="training.md")


def lerobot_s_actions(place, episode):
    """Return the actions that lerobot-eval's loop executes in an episode, (steps, 8)."""
    config = PreTrainedConfig.from_pretrained(place)
    config.device = "cpu"
    model = get_policy_class(config.type).from_pretrained(place, config=config)
    options = RoboIRGEnvConfig(task=TASK, cameras="front", size=96, episode_length=STEPS)
    ((env,),) = [group.values() for group in options.create_envs(1, False).values()]
    own = make_env_pre_post_processors(env_cfg=options, policy_cfg=config)
    processors = make_pre_post_processors(config, pretrained_path=place)
    played = rollout(env, model.eval(), *own, *processors, seeds=[1000 + episode])
    env.close()
    return played["action"][0].numpy()


def our_actions(place, episode):
    """Return the actions that lerobot:// executes in an episode, and how many at a time."""
    policy = make_policy(f"lerobot://{place}", 0)
    rows = []
    act = policy.act
    options = {"cameras": ("front",), "demonstration_frames": "none", "max_steps": STEPS}
    env = make(TASK, episode=episode, **options)
    policy.act = lambda seen: rows.append(act(seen)) or rows[-1]
    play(env, policy)
    env.close()
    return np.concatenate(rows)[:STEPS], [len(row) for row in rows]


@pytest.fixture
def ensembling(folder, tmp_path):
    """A copy of ACT's checkpoint that ensembles over time."""
    place = tmp_path / "ensembling"
    shutil.copytree(folder / "outputs/act" / LAST, place)
    config = json.loads((place / "config.json").read_text())
    config |= {"temporal_ensemble_coeff": 0.01, "n_action_steps": 1}
    (place / "config.json").write_text(json.dumps(config))
    return place


@pytest.mark.parametrize(
    ("kind", "at_a_time"),
    [("act", [8] * 5), ("diffusion", [7, 1] * 5), ("vqbet", [1] * STEPS), ("ensembling", None)],
)
def test_actions_are_those_of_lerobot_s_loop(folder, kind, at_a_time, monkeypatch, request):
    """A policy executes the same actions in our loop and in lerobot-eval's, over 40 steps.

    `at_a_time` is how many each answer has: ACT's chunks of 8; diffusion's 7 and 1 in turn;
    otherwise one. Noise is drawn from the same seed in both, and the arm moves, so that
    equal actions say something.
    """
    place = folder / "outputs" / kind / LAST if at_a_time else request.getfixturevalue(kind)
    draw_the_same(get_policy_class(kind if at_a_time else "act"), monkeypatch)
    expected = lerobot_s_actions(place, 1)

    found, counts = our_actions(place, 1)

    assert np.abs(found - expected).max() == 0
    assert np.ptp(found[:, :7], axis=0).max() > 0
    assert counts == (at_a_time or [1] * STEPS)


def draw_the_same(kind, monkeypatch):
    """Let a type of policies draw the same noise in each of its answers."""
    answer = kind.predict_action_chunk

    def predict_action_chunk(self, *args, **options):
        torch.manual_seed(7)
        return answer(self, *args, **options)

    monkeypatch.setattr(kind, "predict_action_chunk", predict_action_chunk)
