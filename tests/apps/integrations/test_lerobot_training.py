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
def trained(tmp_path_factory):
    """The folder in which the commands of docs/training.md have run, small.

    They export two demonstrations, train three policies for four steps each, and play two episodes
    of at most 40 steps with ACT, by `lerobot-eval` and by `roboirg run`.
    """
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


def test_lerobot_eval_and_roboirg_run_agree_on_success_of_each_episode(trained):
    """In the folder `trained`, the documented commands trained ACT and played two episodes of it,
    with `lerobot-eval` to runs/eval and with `roboirg run` to runs/act.

    Results of `lerobot-eval` are a list of successes, in the order of episodes.
    """
    results = json.loads((trained / "runs" / "eval" / "eval_info.json").read_text())
    (task,) = results["per_task"]
    records = read_records(trained / "runs" / "act")

    ours = {record.episode: record.outcome == "success" for record in records}

    assert ours == dict(enumerate(task["metrics"]["successes"]))
    assert set(ours) == {0, 1}


def test_the_page_names_the_version_that_is_played():
    check_versions(None, page="training.md")


@pytest.fixture(scope="module")
def checkpoints(trained):
    """Folders of the trained policies by their kind, and of a copy of ACT that ensembles."""
    folders = {kind: trained / "outputs" / kind / LAST for kind in SMALL}
    folders["ensembling act"] = trained / "ensembling"
    shutil.copytree(folders["act"], folders["ensembling act"])
    path = folders["ensembling act"] / "config.json"
    ensembling = {"temporal_ensemble_coeff": 0.01, "n_action_steps": 1}
    path.write_text(json.dumps(json.loads(path.read_text()) | ensembling))
    return folders


@pytest.fixture
def equal_noise(monkeypatch):
    """Each answer of a policy draws its noise from the same seed, in every loop."""
    for kind in SMALL:
        draw_from_one_seed(get_policy_class(kind), monkeypatch)


def draw_from_one_seed(policy_class, monkeypatch):
    """Let a class of policies draw the same noise in each of its answers."""
    answer = policy_class.predict_action_chunk

    def predict_action_chunk(self, *args, **options):
        torch.manual_seed(7)
        return answer(self, *args, **options)

    monkeypatch.setattr(policy_class, "predict_action_chunk", predict_action_chunk)


def actions_in_lerobot_s_loop(place, episode):
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


def answers_in_our_loop(place, episode):
    """Return the answers of a `lerobot://` policy in an episode, each (actions, 8)."""
    policy = make_policy(f"lerobot://{place}", 0)
    answers = []
    act = policy.act

    def act_and_keep(observation):
        answers.append(act(observation))
        return answers[-1]

    policy.act = act_and_keep
    options = {"cameras": ("front",), "demonstration_frames": "none", "max_steps": STEPS}
    env = make(TASK, episode=episode, **options)
    play(env, policy)
    env.close()
    return answers


@pytest.mark.usefixtures("equal_noise")
@pytest.mark.parametrize(
    ("kind", "actions_per_answer"),
    [
        ("act", [8, 8, 8, 8, 8]),
        ("diffusion", [7, 1, 7, 1, 7, 1, 7, 1, 7, 1]),
        ("vqbet", [1] * 40),
        ("ensembling act", [1] * 40),
    ],
)
def test_our_loop_executes_the_actions_of_lerobot_s_loop(checkpoints, kind, actions_per_answer):
    """A checkpoint plays 40 steps of an episode in both loops, and its noise is equal in both.

    ACT was trained to execute 8 actions of an answer, and Diffusion Policy plans anew after 7 and 1
    in turn; VQ-BeT and ACT that ensembles over time answer with one. The arm has to move, as equal
    actions of an arm at rest would say nothing.
    """
    theirs = actions_in_lerobot_s_loop(checkpoints[kind], episode=1)

    answers = answers_in_our_loop(checkpoints[kind], episode=1)

    ours = np.concatenate(answers)[:40]
    joint_ranges = np.ptp(ours[:, :7], axis=0)
    assert np.array_equal(ours, theirs)
    assert [len(answer) for answer in answers] == actions_per_answer
    assert joint_ranges.max() > 0
