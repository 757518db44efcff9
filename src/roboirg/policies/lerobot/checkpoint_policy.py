"""lerobot://path-or-hub-id: policies trained with LeRobot, in this process.

A checkpoint declares its inputs. Its names are those of LeRobot's datasets of this robot:
``observation.images.front``, ``observation.images.wrist``, ``observation.state`` (seven joints and
the first finger) and the text ``task``. Its actions are absolute joint targets and the gripper, +1
open to -1 closed.

One episode at a time, a checkpoint is asked as ``lerobot-eval`` asks it, by ``select_action``, so
that its own settings count: steps of a chunk, temporal ensembling, observations that it remembers.
"""

from __future__ import annotations

import copy
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.actions import Actions
from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.observations import (
    PICTURE_SIZE,
    Demonstration,
    Observation,
    proprioception,
)
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.policies.contract.option_checking import NOT_COMPARED
from roboirg.policies.contract.policy_urls import UrlOptions, read_options, split_url
from roboirg.policies.lerobot.checkpoint_facts import PICTURE, STATE, picture_sizes, read_facts
from roboirg.util.media import scaled_square

Item = TypeVar("Item")

_MAX_BRIGHTNESS = 255.0
_GPU_BATCH = 8
"""Episodes that a checkpoint on a GPU is asked about at once, by default."""
_SEEDS = 2**32
"""PyTorch's generators take seeds below this."""
_WORDLESS = frozenset({"act", "diffusion", "tdmpc", "vqbet"})
"""Types of checkpoints that have no input for text."""
_QUEUED = frozenset({
    "act", "diffusion", "multi_task_dit", "pi0", "pi05", "pi0_fast", "smolvla", "vqbet",
})  # fmt: skip
"""Types that keep a chunk in a queue, and forget all but the last `n_obs_steps` observations."""


class LeRobotPolicyOptions(UrlOptions):
    """Options of lerobot://.

    Attributes:
        device: of PyTorch.
        batch: episodes that the checkpoint is asked about at once; None for 1 on the CPU, else 8.
        execute: actions of a chunk that are executed, without ensembling; None for what the
            checkpoint says.
        version: of the checkpoint, for the records.
        prompt_tokens: that the model reads of a prompt; None for what the checkpoint says.
        prompt_added: most tokens of a state that share this budget.
        tokenizer: file of the model's tokenizer.
    """

    device: str = Field("cpu", min_length=1, exclude=NOT_COMPARED)
    batch: int | None = Field(None, ge=1, exclude=NOT_COMPARED)
    execute: int | None = Field(None, ge=1)
    version: str = Field(UNKNOWN_VERSION, min_length=1, exclude=NOT_COMPARED)
    prompt_tokens: int | None = Field(None, ge=1)
    prompt_added: int = Field(0, ge=0)
    tokenizer: str | None = Field(None, min_length=1)


@dataclass
class CheckpointEpisode:
    """What belongs to one episode of a checkpoint.

    Attributes:
        rng: gives the seed of each call's noise.
        model: shares the weights of the policy's, but nothing that its reset sets anew, such as
            a queue of actions.
    """

    rng: np.random.Generator
    model: Any


class LeRobotPolicy:
    """A checkpoint of LeRobot, loaded when the first episode begins, once per process.

    It takes batches: always of `batch` rows, whichever episodes wait, because a model's rounding
    depends on the number of rows.

    Args:
        url: path or hub id, and options.
        seed: unused; each episode has its own.

    Attributes:
        model: LeRobot's policy; None before the first episode.
        metadata: how inputs and outputs are processed, for records.
    """

    demonstration_frames: ClassVar[str] = "none"

    def __init__(self, url: str, seed: int = 0) -> None:  # noqa: ARG002
        """Check the URL, and read what the checkpoint says of itself; it is loaded by `begin`."""
        parts = split_url(url)
        self.options = read_options(parts, LeRobotPolicyOptions)
        self.place = parts.target
        self.version = self.options.version
        facts = read_facts(parts.target)
        self.cameras = tuple(facts.sizes)
        self.prompt_tokens = self.options.prompt_tokens or facts.prompt_tokens
        self.prompt_added = self.options.prompt_added
        self.tokenizer = self.options.tokenizer
        self.metadata: Mapping[str, Any] = {}
        self.model: Any = None  # records name its number types and devices

    def begin(
        self,
        instruction: str,  # noqa: ARG002 - it is in the observations
        demonstration: Demonstration,  # noqa: ARG002
        seed: int = 0,
    ) -> CheckpointEpisode:
        """Load the checkpoint, if this is the first episode, and begin an episode.

        Its model is a shallow copy, which shares the weights; parts with a reset of their own are
        copied, too.

        Raises:
            MissingDependencyError: LeRobot, PyTorch or what the checkpoint needs is not installed.
            InvalidValueError: the checkpoint cannot be loaded, or needs an input that does not
                exist.
        """
        if self.model is None:
            self._load()
        model = copy.copy(self.model)
        for name, part in vars(self.model).items():
            if callable(getattr(part, "reset", None)):  # such as what ensembles actions over time
                setattr(model, name, copy.copy(part))
        model.reset()
        return CheckpointEpisode(np.random.default_rng(seed), model)

    def act_batch(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation]
    ) -> list[Actions]:
        """Return the checkpoint's next actions, (n, 8) for each episode, in their order."""
        import torch

        # One at a time, unless the model takes batches: the noise of an episode, or what the model
        # remembers of it, would else depend on the other episodes.
        size = 1
        if self._takes_batches:
            default = 1 if self.options.device == "cpu" else _GPU_BATCH
            size = self.options.batch or default
        chunks: list[Actions] = []
        with torch.inference_mode():
            for start in range(0, len(states), size):
                stop = start + size
                chunks += self._ask(states[start:stop], observations[start:stop], size)
        return chunks

    def _ask(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation], size: int
    ) -> list[Actions]:
        """Return the model's actions (n, 8) for each of at most `size` episodes, in one batch.

        A batch always has `size` rows, as a model's rounding depends on their number: the last
        episode is repeated to fill it up, and the surplus rows are dropped.
        """
        import torch

        seeds = [int(state.rng.integers(_SEEDS)) for state in states]
        torch.manual_seed(seeds[0])  # before all that may draw random numbers
        batch = self._before(self._batch(_filled_up(observations, size)))
        if size == 1:
            rows = self._select(states[0].model, batch)
        else:
            rows = self._predict(states[0].model, _filled_up(seeds, size), batch)
        # The postprocessor takes the actions of one step.
        steps = [self._after(rows[:, step]) for step in range(rows.shape[1])]
        wanted_rows = torch.stack(steps, dim=1)[: len(states)]
        actions: NDArray[np.float64] = wanted_rows.cpu().numpy().astype(np.float64)
        return list(actions)

    def _predict(self, model: Any, seeds: Sequence[int], batch: dict[str, Any]) -> Any:  # noqa: ANN401
        """Return the chunks of several episodes (episodes, n, 8), each with noise of its own seed.

        The model must remember nothing of an episode, as that of the first one answers for all. A
        model that takes no noise draws none; see `_load_model`.
        """
        import torch

        options = {}
        if self._noise is not None:
            noise = []
            for seed in seeds:
                generator = torch.Generator().manual_seed(seed)
                noise.append(torch.randn(self._noise, generator=generator))
            options["noise"] = torch.stack(noise).to(self.options.device)
        steps = getattr(self._config, "n_action_steps", None)
        return model.predict_action_chunk(batch, **options)[:, :steps]

    def _select(self, model: Any, batch: dict[str, Any]) -> Any:  # noqa: ANN401
        """Return the next actions of one episode (1, n, 8), as ``lerobot-eval`` asks for them.

        That asks before every action; the model answers from a queue until it is empty. Here, all
        are taken from the queue at once that the next observations cannot change any more. Models
        without a queue give one action.
        """
        import torch

        rows = [model.select_action(batch)]
        if self._config.type in _QUEUED:
            # A model that remembers several observations has to see those before its next answer,
            # so as many actions stay in the queue.
            queues = getattr(model, "_queues", None) or {}
            queue = queues.get("action", getattr(model, "_action_queue", ()))
            settled = len(queue) - (self._config.n_obs_steps - 1)
            for _ in range(settled):
                rows.append(model.select_action(batch))
        return torch.stack(rows, dim=1)

    def _batch(self, observations: Sequence[Observation]) -> dict[str, Any]:
        """Return observations in LeRobot's form, by its names of inputs, as tensors.

        Pictures (n, 3, height, width) in [0, 1], states (n, 8) float32, and the list of
        instructions.
        """
        import torch

        states = np.stack([proprioception(observation) for observation in observations])
        batch: dict[str, Any] = {
            STATE: torch.from_numpy(states),
            "task": [observation["instruction"] for observation in observations],
        }
        for camera, width in self._sizes.items():
            pictures = torch.from_numpy(_pictures(observations, camera, width))
            # In LeRobot's layout of memory, on which a model's rounding depends.
            channels_first = pictures.permute(0, 3, 1, 2).contiguous()
            batch[PICTURE.format(camera)] = channels_first.float() / _MAX_BRIGHTNESS
        return batch

    def _load(self) -> None:
        """Load the checkpoint; turn the errors of LeRobot into ours, which `begin` names."""
        place = "" if Path(self.place).is_dir() else " (no folder here, so an id of the Hub)"
        try:
            self._load_model()
        except ImportError as error:
            raise MissingDependencyError(
                f"{self.place!r}{place} needs LeRobot 0.6 in an environment of its own with Python "
                f"3.12: see docs/training.md ({error})."
            ) from error
        except InvalidValueError:
            raise
        except (OSError, ValueError, TypeError) as error:
            raise InvalidValueError(
                f"The checkpoint {self.place!r}{place} cannot be loaded: {one_line(error)}"
            ) from error

    def _load_model(self) -> None:
        """Load configuration, processors and weights; find out how the model may be asked.

        Sets `model` last, so that a checkpoint that could not be loaded is tried again. Whether
        several episodes can be asked about at once depends on where the model gets its noise from.
        """
        from lerobot.policies.factory import get_policy_class, make_pre_post_processors

        config = self._read_config()
        self._config = config

        shapes: dict[str, object] = {}
        for name, feature in (config.input_features or {}).items():
            shapes[name] = getattr(feature, "shape", None)
        self._sizes = picture_sizes(self.place, shapes)

        model = get_policy_class(config.type).from_pretrained(self.place, config=config)
        self._before, self._after = make_pre_post_processors(
            config,
            pretrained_path=self.place,
            preprocessor_overrides={"device_processor": {"device": self.options.device}},
        )
        self._noise = _noise_shape(config, model)
        # Several episodes can be asked about at once if each can get its own noise, or none is
        # drawn. Of types without noise as an argument, only ACT draws none; with ensembling the
        # model remembers its earlier plans, which belong to one episode.
        is_ensembled = getattr(config, "temporal_ensemble_coeff", None) is not None
        draws_nothing = config.type == "act" and not is_ensembled
        self._takes_batches = self._noise is not None or draws_nothing
        self.metadata = _describe(config, self._before, self._after)
        self.model = model.to(self.options.device).eval()

    def _read_config(self) -> Any:  # noqa: ANN401
        """Return LeRobot's configuration of the checkpoint, with the policy's own options.

        With ``execute``, plans are not averaged (ensembled), which needs a plan at every step.
        """
        from lerobot.configs.policies import PreTrainedConfig

        config = PreTrainedConfig.from_pretrained(self.place)
        if self.options.execute is not None:  # checked by LeRobot
            changes: dict[str, Any] = {"n_action_steps": self.options.execute}
            if hasattr(config, "temporal_ensemble_coeff"):
                changes["temporal_ensemble_coeff"] = None
            config = replace(config, **changes)
        config.device = self.options.device
        return config


def _pictures(
    observations: Sequence[Mapping[str, Any]], camera: str, width: int | None
) -> NDArray[np.uint8]:
    """Return the pictures of a camera, (n, width, width, 3); None for their own width."""
    pictures = [observation[f"{camera}_rgb"] for observation in observations]
    if width is not None and width != len(pictures[0]):
        pictures = [scaled_square(picture, width) for picture in pictures]
    return np.stack(pictures)


def _filled_up(items: Sequence[Item], size: int) -> list[Item]:
    """Return `size` items: those given, then the last one as often as it takes."""
    missing = size - len(items)
    return [*items, *[items[-1]] * missing]


def _noise_shape(config: Any, model: Any) -> tuple[int, int] | None:  # noqa: ANN401
    """Return the shape (steps, numbers) of the noise that a chunk is made of; None without."""
    steps = getattr(config, "chunk_size", None)
    dimensions = getattr(config, "max_action_dim", None)
    takes_noise = "noise" in inspect.signature(model.predict_action_chunk).parameters
    if not takes_noise or steps is None or dimensions is None:
        return None
    return steps, dimensions


def _describe(config: Any, before: object, after: object) -> dict[str, Any]:  # noqa: ANN401
    """Return what records say of a checkpoint: how inputs are processed, and settings.

    Args:
        config: LeRobot's configuration of it.
        before: its preprocessor.
        after: its postprocessor.
    """
    inputs = []
    for name, feature in (config.input_features or {}).items():
        shape = getattr(feature, "shape", "")
        inputs.append(f"{name} {shape}".strip())
    steps_before = _step_names(before)
    metadata: dict[str, Any] = {
        "preprocessing": f"the checkpoint declares the inputs {', '.join(inputs)}; roboirg resizes "
        f"pictures from {PICTURE_SIZE} × {PICTURE_SIZE} pixels to the declared height and width, "
        "if these are another square (whether training did likewise: not reported by the "
        "checkpoint), and scales their brightness to [0, 1], the range in which LeRobot's datasets "
        "deliver pictures; then the preprocessor that training saved with it is applied to all "
        f"inputs, in the steps {', '.join(steps_before) or 'none'}; its postprocessor is applied "
        f"to the actions, in the steps {', '.join(_step_names(after)) or 'none'}"
    }
    tokenizers = [name for name in steps_before if "tokenizer" in name]
    if tokenizers:
        metadata["reads_text"] = "yes"
        metadata["text_normalization"] = ", ".join(tokenizers)
    elif config.type in _WORDLESS:
        metadata["reads_text"] = f"no, a policy of type {config.type} has no input for text"
    settings = vars(config)
    if "chunk_size" in settings:
        metadata["chunk"] = settings["chunk_size"]
    if "n_action_steps" in settings:
        metadata["execute"] = settings["n_action_steps"]
    return metadata


def _step_names(processor: object) -> list[str]:
    """Return the names of the steps of LeRobot's pre- or postprocessor, in order."""
    steps = getattr(processor, "steps", ())
    return [getattr(step, "_registry_name", type(step).__name__) for step in steps]
