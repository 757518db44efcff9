"""The adapter for LeRobot, in front of a stand-in for the model and its loading."""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from wire_episode import INSTRUCTION, moment, video

from roboirg.core.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.policies import Policy, load_policy_class, make_policy
from roboirg.policies.lerobot_policy import load
from roboirg.policies.loading import policy_version


def test_a_url_is_checked_without_loading():
    load_policy_class("lerobot://lerobot/some-checkpoint?device=cpu&execute=8")
    policy = make_policy("lerobot://./outputs/last?version=step-3", 0)
    assert isinstance(policy, Policy)
    assert (policy.version, policy._place) == ("step-3", "./outputs/last")
    assert policy_version("lerobot://x/y") == "unknown"
    with pytest.raises(UnknownNameError, match=r"Did you mean 'device'\?"):
        load_policy_class("lerobot://x/y?devise=cpu")


def test_without_lerobot_one_sentence_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "lerobot", None)
    load.cache_clear()
    with pytest.raises(MissingDependencyError, match="pip install lerobot"):
        load("x/y", "cpu")


@pytest.fixture
def checkpoint(monkeypatch):
    """A package `lerobot` with a model that adds up what it sees."""
    torch = pytest.importorskip("torch")

    class Model:
        def __init__(self):
            self.batches, self.resets = [], 0

        def reset(self):
            self.resets += 1

        def to(self, device):
            return self

        def eval(self):
            return self

        def predict_action_chunk(self, batch):
            self.batches.append(batch)
            return batch["observation.state"][:, None].repeat(1, 6, 1) + torch.rand(1, 6, 1)

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
        make_pre_post_processors=lambda *a, **k: (lambda batch: batch, lambda row: row * 2),
    )
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    load.cache_clear()
    yield SimpleNamespace(model=model, config=config)
    load.cache_clear()


def test_a_checkpoint_is_fed_its_own_names(checkpoint):
    policy = make_policy("lerobot://x/y?execute=4", 5)
    policy.reset(INSTRUCTION, video(0))
    first = policy.act(moment(1))
    assert first.shape == (4, 8)
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


def test_a_checkpoint_that_wants_another_camera_is_told(checkpoint):
    checkpoint.config.input_features = {"observation.images.laptop": None}
    with pytest.raises(InvalidValueError, match=r"needs 'observation\.images\.laptop'"):
        make_policy("lerobot://x/y", 0).reset(INSTRUCTION, video(0))
