"""The adapter for LeRobot, in front of stand-ins for models and their loading."""

import sys
from collections import deque
from dataclasses import dataclass
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from checkpoint_folders import write_checkpoint
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from wire_episode import INSTRUCTION, moment, video

from roboirg.core.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.core.inference_facts import inference_facts
from roboirg.policies import Policy, find_policy, make_policy
from roboirg.policies.contract.batch_policy import forget_batched

STATE = "observation.state"
FRONT = "observation.images.front"
WRIST = "observation.images.wrist"


def test_a_lerobot_policy_has_the_version_and_the_folder_of_its_url(tmp_path):
    """The checkpoint is a folder with a configuration and no weights: nothing is loaded before the
    first episode.
    """
    folder = write_checkpoint(tmp_path / "last")

    policy = make_policy(f"lerobot://{folder}?version=step-3", 0)

    assert isinstance(policy, Policy)
    assert policy.version == "step-3"
    assert policy.place == str(folder)


def test_the_version_of_a_lerobot_policy_is_unknown_if_its_url_names_none():
    assert find_policy("lerobot://lerobot/some-checkpoint?device=cpu").version == "unknown"


def test_a_misspelled_option_of_a_lerobot_url_is_refused():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'device'\?"):
        find_policy("lerobot://x/y?devise=cpu")


def test_a_lerobot_policy_without_lerobot_installed_fails_with_instructions(monkeypatch):
    monkeypatch.setitem(sys.modules, "lerobot.configs.policies", None)
    with pytest.raises(MissingDependencyError, match=r"Python 3\.12: see docs/training.md"):
        policy_after_reset()


class Processor:
    def __init__(self, change, *steps):
        self.change = change
        self.steps = steps

    def __call__(self, value):
        return self.change(value)


def step(name):
    return SimpleNamespace(_registry_name=name)


def make_model(torch, config):
    """Return a model whose actions are sums of what it remembers, acting as LeRobot's do."""

    class Averages:
        """Averages what earlier chunks planned for a step."""

        def reset(self):
            self.plans = None

        def update(self, rows):
            plans = [] if self.plans is None else self.plans
            self.plans = [plan[:, 1:] for plan in plans if plan.shape[1] > 1] + [rows]
            return torch.stack([plan[:, 0] for plan in self.plans]).mean(dim=0)

    class Model(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.weight = torch.nn.Parameter(torch.zeros(1, dtype=torch.bfloat16))
            self.batches = []
            self.averages = Averages()
            self.config = config

        def reset(self):
            self.averages.reset()
            self._queues = {STATE: deque(maxlen=self.config.n_obs_steps), "action": deque()}

        def to(self, device):
            return self

        def eval(self):
            return self

        def predict_action_chunk(self, batch, noise=None):
            self.batches.append(batch)
            seen = torch.stack([*self._queues[STATE]] or [batch[STATE]]).cumsum(0)[-1]
            rows = seen[:, None].repeat(1, 6, 1) + torch.arange(6)[:, None]
            if noise is not None:
                return rows + noise[:, :6, :1]
            return rows + (torch.rand(len(batch["task"]), 6, 1) if self.config.is_noisy else 0)

        def select_action(self, batch):
            seen = self._queues[STATE]
            seen.append(batch[STATE])
            while len(seen) < self.config.n_obs_steps:
                seen.append(batch[STATE])
            if self.config.temporal_ensemble_coeff is not None:
                return self.averages.update(self.predict_action_chunk(batch))
            if not self._queues["action"]:
                rows = self.predict_action_chunk(batch)[:, : self.config.n_action_steps]
                self._queues["action"].extend(rows.transpose(0, 1))
            return self._queues["action"].popleft()

    return Model()


@dataclass
class Config:
    """What a checkpoint of ACT configures; `replace` makes it anew, with LeRobot's own check."""

    input_features: dict
    type: str = "act"
    n_obs_steps: int = 1
    n_action_steps: int = 6
    chunk_size: int = 6
    temporal_ensemble_coeff: float | None = None
    is_noisy: bool = False

    def __post_init__(self):
        if self.n_action_steps > self.chunk_size:
            raise ValueError("The chunk size is the upper bound")


@pytest.fixture
def checkpoint(monkeypatch):
    """A package `lerobot` with a model of our own."""
    torch = pytest.importorskip("torch")
    config = Config(input_features=dict.fromkeys((STATE, FRONT, WRIST)))
    model = make_model(torch, config)
    before = Processor(lambda batch: batch, step("tokenizer_processor"))
    after = Processor(lambda row: row * 2, step("unnormalizer_processor"))
    modules = {
        name: ModuleType(name) for name in ("lerobot", "lerobot.configs", "lerobot.policies")
    }
    modules["lerobot.configs.policies"] = SimpleNamespace(
        PreTrainedConfig=SimpleNamespace(from_pretrained=lambda place: config)
    )
    modules["lerobot.policies.factory"] = SimpleNamespace(
        get_policy_class=lambda kind: SimpleNamespace(
            from_pretrained=lambda p, config: vars(model).update(config=config) or model
        ),
        make_pre_post_processors=lambda *a, **k: (before, after),
    )
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    return SimpleNamespace(model=model, config=config, before=before)


def policy_after_reset(seed=0, options=""):
    """Return a policy whose episode has begun, with the checkpoint loaded for it."""
    spec = f"lerobot://x/y{options}"
    forget_batched(spec)
    policy = make_policy(spec, seed)
    policy.reset(INSTRUCTION, video(0))
    return policy


def first_batch(checkpoint):
    """Return what the model of a checkpoint gets in the first step of an episode."""
    policy_after_reset().act(moment(1))

    (batch,) = checkpoint.model.batches
    return batch


def test_a_checkpoint_gets_pictures_and_state_under_lerobot_s_names(checkpoint):
    """STATE, FRONT and WRIST are LeRobot's names, such as `observation.state`.

    A picture has its channels first and values from 0 to 1: turned back, it is the one that was
    seen.
    """
    batch = first_batch(checkpoint)

    assert set(batch) == {"task", STATE, FRONT, WRIST}
    assert batch["task"] == [INSTRUCTION]
    shown = batch[FRONT][0].permute(1, 2, 0).numpy() * 255
    assert np.allclose(shown, moment(1)["front_rgb"])


def test_the_metadata_of_a_checkpoint_name_its_processors_and_its_chunk(checkpoint):
    """The stand-in has a tokenizer before the model, an unnormalizer behind it, and chunks of six.

    Of a chunk four actions are played, as the option says.
    """
    policy = policy_after_reset(options="?execute=4")

    assert "tokenizer_processor" in policy.metadata["preprocessing"]
    assert "unnormalizer_processor" in policy.metadata["preprocessing"]
    assert policy.metadata["text_normalization"] == "tokenizer_processor"
    assert policy.metadata["chunk"] == 6
    assert policy.metadata["execute"] == 4


def test_the_type_and_device_of_a_checkpoint_s_weights_are_reported(checkpoint):
    """The stand-in model has one weight, in bfloat16, on the CPU."""
    facts = inference_facts(policy_after_reset())

    assert (facts.dtypes, facts.devices) == (("bfloat16",), ("cpu",))


def test_the_noise_of_a_checkpoint_depends_on_the_seed_of_the_policy(checkpoint):
    """The stand-in model adds random noise to its actions: seed 5 repeats it, seed 6 does not."""
    checkpoint.config.is_noisy = True

    first = policy_after_reset(5).act(moment(1))

    assert np.array_equal(policy_after_reset(5).act(moment(1)), first)
    assert not np.array_equal(policy_after_reset(6).act(moment(1)), first)


@pytest.mark.parametrize(
    ("declared", "size"), [((3, 4, 4), (4, 4)), ((3, 4, 6), (8, 8))], ids=["square", "no square"]
)
def test_pictures_are_resized_to_the_square_that_a_checkpoint_declares(checkpoint, declared, size):
    """Pictures here have 8 x 8 pixels, and the checkpoint (a stand-in) has no wrist camera.

    A declared square of 4 x 4 is what it gets; a shape that is no square, 4 x 6, is ignored. A
    batch is one picture, with its three channels first.
    """
    checkpoint.config.input_features = {STATE: None, FRONT: SimpleNamespace(shape=declared)}

    batch = first_batch(checkpoint)

    assert set(batch) == {"task", STATE, FRONT}
    assert batch[FRONT].shape == (1, 3, *size)


def test_a_resized_picture_has_the_means_of_its_pixels(checkpoint):
    """Pictures of 8 x 8 pixels are shrunk to the 4 x 4 that the checkpoint (a stand-in) declares.

    Each new pixel is the mean of 2 x 2 old ones. The model gets channels first and values from 0
    to 1; in values from 0 to 255, rounding to whole numbers makes a difference of at most 0.5.
    """
    checkpoint.config.input_features = {FRONT: SimpleNamespace(shape=(3, 4, 4))}

    batch = first_batch(checkpoint)

    means = moment(1)["front_rgb"].reshape(4, 2, 4, 2, 3).mean(axis=(1, 3))
    assert np.allclose(batch[FRONT][0].permute(1, 2, 0).numpy() * 255, means, atol=0.51)


def actions_of_lerobot_s_loop(model, length):
    """Return the actions of LeRobot's loop: one for each observation, (length, 8)."""
    model.reset()
    torch = sys.modules["torch"]
    rows = []
    for number in range(length):
        seen = moment(number)
        state = np.append(seen["joint_positions"], seen["gripper"][0]).astype(np.float32)
        batch = {STATE: torch.from_numpy(state)[None], "task": [INSTRUCTION]}
        rows.append(model.select_action(batch)[0].numpy() * 2)
    return np.stack(rows)


def configure(checkpoint, **fields):
    """Set fields of the configuration of the stand-in checkpoint."""
    for name, value in fields.items():
        setattr(checkpoint.config, name, value)


def act_in_turns(episodes, steps):
    """Let episodes take turns; return the actions of each for the moments 0 to steps - 1."""
    played = [[] for _ in episodes]
    while min(map(len, played)) < steps:
        for policy, rows in zip(episodes, played, strict=True):
            if len(rows) < steps:
                rows += list(policy.act(moment(len(rows))))
    return [np.stack(rows)[:steps] for rows in played]


KINDS_OF_MODELS = ["act", "diffusion", "vqbet", "somebody_s_plugin"]


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    kind=st.sampled_from(KINDS_OF_MODELS),
    n_obs_steps=st.integers(1, 5),
    n_action_steps=st.integers(1, 6),
    averages=st.booleans(),
)
def test_two_interleaved_episodes_get_the_actions_of_lerobot_s_own_loop(
    checkpoint, kind, n_obs_steps, n_action_steps, averages
):
    """LeRobot's own loop asks for one action after each observation, here for 24. Two episodes of
    our policy take turns with the same observations, and each gets the same 24 actions: neither
    sees anything of the other.

    An action of the stand-in model is a sum of the last `n_obs_steps` observations, so that any
    other input shows. Of each chunk that it plans, `n_action_steps` are played; or one, the mean of
    what all chunks planned for its step (then `temporal_ensemble_coeff` is a number).
    """
    configure(checkpoint, type=kind, n_obs_steps=n_obs_steps, n_action_steps=n_action_steps)
    configure(checkpoint, temporal_ensemble_coeff=None)
    if averages:
        configure(checkpoint, temporal_ensemble_coeff=0.01, n_action_steps=1)
    expected = actions_of_lerobot_s_loop(checkpoint.model, 24)

    first, second = act_in_turns([policy_after_reset(), policy_after_reset()], steps=24)

    assert np.allclose(first, expected, atol=1e-6)
    assert np.allclose(second, expected, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS_OF_MODELS)
@pytest.mark.parametrize(("n_action_steps", "calls"), [(1, 24), (2, 12), (5, 5), (6, 4)])
def test_a_checkpoint_is_called_once_for_the_actions_of_a_chunk(
    checkpoint, kind, n_action_steps, calls
):
    """An episode of 24 steps plays `n_action_steps` of each chunk: 24 / 5 chunks are rounded up."""
    configure(checkpoint, type=kind, n_action_steps=n_action_steps)

    act_in_turns([policy_after_reset()], steps=24)

    assert len(checkpoint.model.batches) == calls


@pytest.mark.parametrize("kind", ["act", "diffusion", "vqbet"])
@pytest.mark.parametrize(
    ("n_obs_steps", "n_action_steps", "played"), [(1, 6, 6), (2, 6, 5), (5, 6, 2), (5, 3, 1)]
)
def test_of_a_chunk_the_actions_from_the_present_on_are_played(
    checkpoint, kind, n_obs_steps, n_action_steps, played
):
    """The model sees the last `n_obs_steps` observations, and the first of its `n_action_steps`
    actions belong to the earlier ones of these: with two observations the first action is past.

    At least one action is played.
    """
    configure(checkpoint, type=kind, n_obs_steps=n_obs_steps, n_action_steps=n_action_steps)

    assert len(policy_after_reset().act(moment(0))) == played


@pytest.mark.parametrize(
    ("options", "ensemble", "count"),
    [("", None, 2), ("?execute=5", None, 5), ("?execute=3", 0.01, 3)],
    ids=["as configured", "option", "option with averaging"],
)
def test_the_option_execute_changes_how_many_actions_of_a_chunk_are_played(
    checkpoint, options, ensemble, count
):
    """The checkpoint plans six actions, and says that two are to be played."""
    checkpoint.config.n_action_steps = 2
    checkpoint.config.temporal_ensemble_coeff = ensemble

    assert len(policy_after_reset(options=options).act(moment(1))) == count


def test_more_actions_than_a_chunk_has_cannot_be_played(checkpoint):
    """It plans six."""
    with pytest.raises(InvalidValueError, match=r"loaded: ValueError: The chunk size is the upper"):
        policy_after_reset(options="?execute=7")


def test_a_checkpoint_without_a_tokenizer_is_noted_as_not_reading_text(checkpoint):
    """The stand-in's steps before the model are removed, and with them its tokenizer."""
    checkpoint.before.steps = ()

    assert policy_after_reset().metadata["reads_text"].startswith("no, ")


def test_a_checkpoint_of_groot_reads_text_without_a_tokenizer_in_front_of_it(checkpoint):
    """It has one inside."""
    checkpoint.config.type = "groot"
    checkpoint.before.steps = ()

    assert "reads_text" not in policy_after_reset().metadata


def test_episodes_in_a_batch_get_the_actions_that_they_get_alone(checkpoint):
    """Five episodes come to the model in batches of four: the second is filled up to four.

    Each episode's noise comes from its own seed, so that its actions are to the bit those that it
    gets alone.
    """
    checkpoint.config.max_action_dim = 32
    moments = [moment(number) for number in range(5)]
    episodes = [policy_after_reset(seed, "?batch=4") for seed in range(5)]

    together = episodes[0].act_together(episodes, moments)

    assert [len(batch["task"]) for batch in checkpoint.model.batches] == [4, 4]
    for seed in range(5):
        alone = policy_after_reset(seed, "?batch=4").act(moments[seed])
        assert np.array_equal(alone, together[seed]), seed


def test_each_call_of_a_batched_episode_has_noise_of_its_own(checkpoint):
    """Both calls show the same moment, so only their noise can differ. (A model that declares
    `max_action_dim` takes its noise from outside.)
    """
    checkpoint.config.max_action_dim = 32
    policy = policy_after_reset(0, "?batch=4")

    assert not np.array_equal(policy.act(moment(0)), policy.act(moment(0)))


@pytest.mark.parametrize("remembers", [{"type": "diffusion"}, {"temporal_ensemble_coeff": 0.01}])
def test_checkpoints_with_memory_are_not_batched(checkpoint, remembers):
    """A model of the kind "diffusion", or one that averages over its chunks, remembers past calls.

    So three episodes are three calls of the model with one episode each, despite `batch=4`.
    """
    configure(checkpoint, **remembers)
    episodes = [policy_after_reset(seed, "?batch=4") for seed in range(3)]

    episodes[0].act_together(episodes, [moment(1), moment(1), moment(1)])

    assert [len(batch["task"]) for batch in checkpoint.model.batches] == [1, 1, 1]


def test_an_episode_that_is_not_batched_has_the_noise_that_it_has_alone(checkpoint):
    """A model of the kind "diffusion" is asked one episode after the other. Here it adds random
    noise to its actions; that of the second episode depends on its own seed, 1, alone.
    """
    configure(checkpoint, type="diffusion", is_noisy=True)
    episodes = [policy_after_reset(0, "?batch=4"), policy_after_reset(1, "?batch=4")]

    _, together = episodes[0].act_together(episodes, [moment(1), moment(1)])

    alone = policy_after_reset(1, "?batch=4").act(moment(1))
    assert np.array_equal(together, alone)
