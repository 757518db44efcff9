"""The adapter for LeRobot, in front of a stand-in for the model and its loading."""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from wire_episode import INSTRUCTION, moment, video

from roboirg.core.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.core.inference_facts import inference_facts
from roboirg.policies import Policy, load_policy_class, make_policy
from roboirg.policies.by_name.loading import policy_version
from roboirg.policies.lerobot_policy import load


def test_a_url_is_checked_without_loading():
    load_policy_class("lerobot://lerobot/some-checkpoint?device=cpu&execute=8")
    policy = make_policy("lerobot://./outputs/last?version=step-3", 0)
    assert isinstance(policy, Policy)
    assert (policy.version, policy.place) == ("step-3", "./outputs/last")
    assert policy_version("lerobot://x/y") == "unknown"
    with pytest.raises(UnknownNameError, match=r"Did you mean 'device'\?"):
        load_policy_class("lerobot://x/y?devise=cpu")


def test_without_lerobot_one_sentence_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "lerobot", None)
    load.cache_clear()
    with pytest.raises(MissingDependencyError, match="pip install lerobot"):
        load("x/y", "cpu")


class Processor:
    def __init__(self, change, *steps):
        self.change, self.steps = change, steps

    def __call__(self, value):
        return self.change(value)


def step(name, **modes):
    return SimpleNamespace(_registry_name=name, get_config=lambda: {"norm_map": modes})


@pytest.fixture
def checkpoint(monkeypatch):
    """A package `lerobot` with a model that adds up what it sees."""
    torch = pytest.importorskip("torch")

    class Model(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.weight = torch.nn.Parameter(torch.zeros(1, dtype=torch.bfloat16))
            self.batches, self.resets = [], 0

        def reset(self):
            self.resets += 1

        def to(self, device):
            return self

        def eval(self):
            return self

        def predict_action_chunk(self, batch, noise=None):
            self.batches.append(batch)
            if noise is None:
                noise = torch.rand(len(batch["task"]), 6, 1)
            return batch["observation.state"][:, None].repeat(1, 6, 1) + noise[:, :6, :1]

    before = Processor(lambda batch: batch, step("tokenizer_processor"))
    after = Processor(lambda row: row * 2, step("unnormalizer_processor", ACTION="MEAN_STD"))
    model = Model()
    config = SimpleNamespace(type="act", input_features={"observation.state": None})
    modules = {
        name: ModuleType(name) for name in ("lerobot", "lerobot.configs", "lerobot.policies")
    }
    modules["lerobot.configs.policies"] = SimpleNamespace(
        PreTrainedConfig=SimpleNamespace(from_pretrained=lambda place: config)
    )
    modules["lerobot.policies.factory"] = SimpleNamespace(
        get_policy_class=lambda kind: SimpleNamespace(from_pretrained=lambda p, config: model),
        make_pre_post_processors=lambda *a, **k: (before, after),
    )
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    load.cache_clear()
    yield SimpleNamespace(model=model, config=config, before=before)
    load.cache_clear()


def test_a_checkpoint_is_fed_its_own_names(checkpoint):
    policy = make_policy("lerobot://x/y?execute=4", 5)
    policy.reset(INSTRUCTION, video(0))
    first = policy.act(moment(1))
    assert first.shape == (4, 8)
    facts = inference_facts(policy)
    assert (facts.dtypes, facts.devices) == (("bfloat16",), ("cpu",))
    for name in ("tokenizer_processor", "unnormalizer_processor (ACTION MEAN_STD)"):
        assert name in policy.metadata["preprocessing"]
    assert policy.metadata["text_normalization"] == "tokenizer_processor"
    batch = checkpoint.model.batches[0]
    assert batch["task"] == [INSTRUCTION]
    picture = batch["observation.images.front"]
    assert picture.shape == (1, 3, 8, 8)
    assert np.allclose(picture[0].permute(1, 2, 0).numpy() * 255, moment(1)["front_rgb"])
    assert set(batch) == {
        "task",
        "observation.state",
        "observation.images.front",
        "observation.images.wrist",
    }
    again = make_policy("lerobot://x/y?execute=4", 5)
    again.reset(INSTRUCTION, video(0))
    assert np.array_equal(again.act(moment(1)), first)
    assert checkpoint.model.resets == 2


@pytest.mark.parametrize(("kind", "reads"), [("act", "no, "), ("groot", "")])
def test_a_checkpoint_without_a_tokenizer_may_have_one_inside(checkpoint, kind, reads):
    checkpoint.config.type, checkpoint.before.steps = kind, ()
    policy = make_policy("lerobot://x/y", 0)
    policy.reset(INSTRUCTION, video(0))
    assert policy.metadata.get("reads_text", "").startswith(reads)
    assert ("reads_text" in policy.metadata) == bool(reads)


def test_rows_of_a_batch_depend_on_their_own_episode(checkpoint):
    checkpoint.config.chunk_size, checkpoint.config.max_action_dim = 6, 32
    episodes = [make_policy("lerobot://x/y?batch=4", seed) for seed in range(5)]
    for one in episodes:
        one.reset(INSTRUCTION, video(0))
    moments = [moment(number) for number in range(5)]
    together = episodes[0].act_together(episodes, moments)
    assert [len(batch["task"]) for batch in checkpoint.model.batches] == [4, 4]  # always as many
    again = [make_policy("lerobot://x/y?batch=4", seed) for seed in range(5)]
    for one, now, expected in zip(again, moments, together, strict=True):
        one.reset(INSTRUCTION, video(0))
        assert np.array_equal(one.act(now), expected)
    assert not np.array_equal(again[0].act(moments[0]), together[0])  # other noise in each call


def test_checkpoints_that_draw_their_own_noise_are_asked_one_by_one(checkpoint):
    checkpoint.config.type = "diffusion"
    episodes = [make_policy("lerobot://x/y?batch=4", seed) for seed in range(3)]
    for one in episodes:
        one.reset(INSTRUCTION, video(0))
    together = episodes[0].act_together(episodes, [moment(1)] * 3)
    assert [len(batch["task"]) for batch in checkpoint.model.batches] == [1, 1, 1]
    alone = make_policy("lerobot://x/y?batch=4", 2)
    alone.reset(INSTRUCTION, video(0))
    assert np.array_equal(alone.act(moment(1)), together[2])


def test_episodes_do_not_share_what_a_model_remembers(checkpoint):
    model = checkpoint.model
    model.reset = lambda: setattr(model, "queue", [])

    def predict(batch):
        model.queue.append(1)
        return batch["observation.state"][:, None] * 0 + len(model.queue)

    model.predict_action_chunk = predict
    first, second = (make_policy("lerobot://x/y", seed) for seed in range(2))
    first.reset(INSTRUCTION, video(0))
    second.reset(INSTRUCTION, video(0))
    counts = [one.act(moment(1))[0, 0] for one in (first, second, first, first, second)]
    assert counts == [2, 2, 4, 6, 4]  # the stand-in doubles


def test_a_checkpoint_that_wants_another_camera_is_told(checkpoint):
    checkpoint.config.input_features = {"observation.images.laptop": None}
    with pytest.raises(InvalidValueError, match=r"needs 'observation\.images\.laptop'"):
        make_policy("lerobot://x/y", 0).reset(INSTRUCTION, video(0))
