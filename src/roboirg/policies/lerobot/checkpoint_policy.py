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
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.actions import Actions
from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.observations import Demonstration, Observation
from roboirg.core.policy_ref import UNKNOWN_VERSION
from roboirg.policies.contract.option_checking import NOT_COMPARED
from roboirg.policies.contract.policy_urls import UrlOptions, read_options, split_url
from roboirg.policies.lerobot.checkpoint_facts import PICTURE, STATE, picture_sizes, read_facts
from roboirg.util.media import scaled_square

_MAX_BRIGHTNESS = 255.0
_BATCH = 8
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
        parts = split_url(url)
        self.options = read_options(parts, LeRobotPolicyOptions)
        self.place, self.version = parts.target, self.options.version
        facts = read_facts(parts.target)
        self.cameras = tuple(facts.sizes)
        self.prompt_tokens = self.options.prompt_tokens or facts.prompt_tokens
        self.prompt_added, self.tokenizer = self.options.prompt_added, self.options.tokenizer
        self.metadata: Mapping[str, Any] = {}
        self.model: Any = None  # records name its number types and devices

    def begin(
        self,
        instruction: str,  # noqa: ARG002 - it is in the observations
        demonstration: Demonstration,  # noqa: ARG002
        seed: int = 0,
    ) -> CheckpointEpisode:
        """Load the checkpoint and begin an episode.

        Raises:
            MissingDependencyError: LeRobot, PyTorch or what the checkpoint needs is not installed.
            InvalidValueError: the checkpoint cannot be loaded, or needs an input that does not
                exist.
        """
        if self.model is None:
            self._load()
        model = copy.copy(self.model)
        for name, one in vars(self.model).items():
            if callable(getattr(one, "reset", None)):  # such as what ensembles actions over time
                setattr(model, name, copy.copy(one))
        model.reset()
        return CheckpointEpisode(np.random.default_rng(seed), model)

    def act_batch(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation]
    ) -> list[Actions]:
        """Return the checkpoint's next actions, (n, 8) for each episode."""
        import torch

        size = 1  # the noise of an episode, or what is remembered of it, would depend on the others
        if self._takes_batches:
            size = self.options.batch or (1 if self.options.device == "cpu" else _BATCH)
        chunks: list[Actions] = []
        with torch.inference_mode():
            for start in range(0, len(states), size):
                stop = start + size
                chunks += self._ask(states[start:stop], observations[start:stop], size)
        return chunks

    def _ask(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation], size: int
    ) -> list[Actions]:
        """Ask the model about at most `size` episodes; the last one fills up the batch."""
        import torch

        count = len(states)
        seeds = [int(state.rng.integers(2**32)) for state in states]
        torch.manual_seed(seeds[0])
        batch = self._before(self._batch([*observations, *[observations[-1]] * (size - count)]))
        if size == 1:
            rows = self._select(states[0].model, batch)
        else:
            rows = self._predict(states[0].model, [*seeds, *[seeds[-1]] * (size - count)], batch)
        rows = torch.stack([self._after(rows[:, i]) for i in range(rows.shape[1])], dim=1)
        actions: NDArray[np.float64] = rows[:count].cpu().numpy().astype(np.float64)
        return list(actions)

    def _predict(self, model: Any, seeds: Sequence[int], batch: dict[str, Any]) -> Any:  # noqa: ANN401
        """Return the chunks of several episodes, of which the model remembers nothing."""
        import torch

        options = {}
        if self._noise is not None:
            noise = [
                torch.randn(self._noise, generator=torch.Generator().manual_seed(seed))
                for seed in seeds
            ]
            options["noise"] = torch.stack(noise).to(self.options.device)
        steps = getattr(self._config, "n_action_steps", None)
        return model.predict_action_chunk(batch, **options)[:, :steps]

    def _select(self, model: Any, batch: dict[str, Any]) -> Any:  # noqa: ANN401
        """Return the actions of one episode that no observation can change any more, (1, n, 8)."""
        import torch

        rows = [model.select_action(batch)]
        if self._config.type in _QUEUED:
            # The last ones wait for the observations that the next answer depends on.
            queues = getattr(model, "_queues", None) or {}
            decided = len(queues.get("action", getattr(model, "_action_queue", ())))
            settled = decided - (self._config.n_obs_steps - 1)
            rows += [model.select_action(batch) for _ in range(settled)]
        return torch.stack(rows, dim=1)

    def _batch(self, observations: Sequence[Observation]) -> dict[str, Any]:
        """Return observations in LeRobot's form: pictures (n, 3, H, W) in [0, 1]."""
        import torch

        states = [np.append(one["joint_positions"], one["gripper"][0]) for one in observations]
        batch: dict[str, Any] = {
            STATE: torch.from_numpy(np.stack(states).astype(np.float32)),
            "task": [one["instruction"] for one in observations],
        }
        for camera, width in self._sizes.items():
            seen = [one[f"{camera}_rgb"] for one in observations]  # type: ignore[literal-required]
            if width is not None and width != len(seen[0]):
                seen = [scaled_square(one, width) for one in seen]
            # In LeRobot's layout of memory, on which a model's rounding depends.
            channels_first = torch.from_numpy(np.stack(seen)).permute(0, 3, 1, 2).contiguous()
            batch[PICTURE.format(camera)] = channels_first.float() / _MAX_BRIGHTNESS
        return batch

    def _load(self) -> None:
        """Load the checkpoint; raises like `begin`."""
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
        from lerobot.configs.policies import PreTrainedConfig
        from lerobot.policies.factory import get_policy_class, make_pre_post_processors

        place, device = self.place, self.options.device
        config = PreTrainedConfig.from_pretrained(place)
        if self.options.execute is not None:  # checked by LeRobot
            single = {"temporal_ensemble_coeff": None}
            unset = single if hasattr(config, "temporal_ensemble_coeff") else {}
            config = replace(config, n_action_steps=self.options.execute, **unset)
        config.device, self._config = device, config
        features = config.input_features or {}
        shapes = {name: getattr(one, "shape", None) for name, one in features.items()}
        self._sizes = picture_sizes(place, shapes)
        model = get_policy_class(config.type).from_pretrained(place, config=config)
        self._before, self._after = make_pre_post_processors(
            config,
            pretrained_path=place,
            preprocessor_overrides={"device_processor": {"device": device}},
        )
        takes = inspect.signature(model.predict_action_chunk).parameters
        shape = getattr(config, "chunk_size", None), getattr(config, "max_action_dim", None)
        self._noise = shape if "noise" in takes and None not in shape else None
        # Of other types, ACT alone draws no noise; ensembling needs each episode's own plans.
        is_ensembled = getattr(config, "temporal_ensemble_coeff", None) is not None
        self._takes_batches = self._noise is not None or (config.type == "act" and not is_ensembled)
        self.metadata = _describe(config, self._before, self._after)
        self.model = model.to(device).eval()


def _describe(config: Any, before: object, after: object) -> dict[str, Any]:  # noqa: ANN401
    """Return a checkpoint's metadata, from its configuration and its processors."""
    inputs = [
        f"{name} {getattr(one, 'shape', '')}".strip()
        for name, one in (config.input_features or {}).items()
    ]
    names = _step_names(before)
    found: dict[str, Any] = {
        "preprocessing": f"the checkpoint declares the inputs {', '.join(inputs)}; roboirg resizes "
        "pictures from 256 × 256 pixels to the declared height and width, if these are another "
        "square (whether training did likewise: not reported by the checkpoint), and scales their "
        "brightness to [0, 1], the range in which LeRobot's datasets deliver pictures; then the "
        "preprocessor that training saved with it is applied to all inputs, in the steps "
        f"{', '.join(names) or 'none'}; its postprocessor is applied to the actions, in the steps "
        f"{', '.join(_step_names(after)) or 'none'}"
    }
    if tokenizers := [name for name in names if "tokenizer" in name]:
        found |= {"reads_text": "yes", "text_normalization": ", ".join(tokenizers)}
    elif config.type in _WORDLESS:
        found["reads_text"] = f"no, a policy of type {config.type} has no input for text"
    sizes = {"chunk": "chunk_size", "execute": "n_action_steps"}
    return found | {key: vars(config)[one] for key, one in sizes.items() if one in vars(config)}


def _step_names(processor: object) -> list[str]:
    steps = getattr(processor, "steps", ())
    return [getattr(step, "_registry_name", type(step).__name__) for step in steps]
