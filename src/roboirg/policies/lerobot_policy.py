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
import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.observations import Demonstration, Observation
from roboirg.policies.contract.policy_urls import UrlOptions, read_options, split_url
from roboirg.policies.lerobot_checkpoint import PICTURE, STATE, picture_sizes, read_facts
from roboirg.util.media import scaled_square

_MAX_BRIGHTNESS = 255.0
_BATCH = 8
_MAX_WORDS = 300
_NOISELESS = frozenset({"act"})
"""Types of checkpoints that draw no noise when they act."""
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

    device: str = Field("cpu", min_length=1)
    batch: int | None = Field(None, ge=1)
    execute: int | None = Field(None, ge=1)
    version: str | None = Field(None, min_length=1)
    prompt_tokens: int | None = Field(None, ge=1)
    prompt_added: int = Field(0, ge=0)
    tokenizer: str | None = Field(None, min_length=1)


class LoadedCheckpoint(NamedTuple):
    """A checkpoint in memory.

    Attributes:
        model: LeRobot's policy.
        before: turns a batch into the model's inputs.
        after: turns the model's outputs into actions.
        sizes: width of its square pictures by camera; None where it declares no square.
        noise: shape of the noise that the model takes for each episode; None if it takes none.
        is_noiseless: whether it is known to draw none either.
        steps: actions of a chunk that are executed; None for all.
        remembered: observations that an answer depends on; None if that is not known.
        metadata: how its inputs and outputs are processed, for records.
    """

    model: Any
    before: Callable[[dict[str, Any]], dict[str, Any]]
    after: Callable[[Any], Any]
    sizes: Mapping[str, int | None]
    noise: tuple[int, int] | None = None
    is_noiseless: bool = False
    steps: int | None = None
    remembered: int | None = None
    metadata: Mapping[str, Any] = {}


@dataclass
class CheckpointEpisode:
    """What belongs to one episode of a checkpoint.

    Attributes:
        seed: of its noise.
        memory: attributes of the model that its reset sets anew, such as queues.
        calls: how often it was asked.
    """

    seed: int
    memory: dict[str, Any]
    calls: int = 0

    def next_seed(self) -> int:
        """Return the seed of the next call, another one each time."""
        self.calls += 1
        return int(np.random.SeedSequence((self.seed, self.calls)).generate_state(1)[0])


class LeRobotPolicy:
    """A checkpoint of LeRobot, loaded when the first episode begins, once per process.

    It takes batches: always of `batch` rows, whichever episodes wait, because a model's rounding
    depends on the number of rows.

    Args:
        url: path or hub id, and options.
        seed: unused; each episode has its own.
    """

    demonstration_frames: ClassVar[str] = "none"

    def __init__(self, url: str, seed: int = 0) -> None:
        del seed
        parts = split_url(url)
        self.options = read_options(parts, LeRobotPolicyOptions)
        self.place = parts.place
        facts = read_facts(parts.place)
        self.cameras = tuple(facts.sizes)
        self.prompt_tokens = self.options.prompt_tokens or facts.prompt_tokens
        self.prompt_added, self.tokenizer = self.options.prompt_added, self.options.tokenizer
        self.metadata: Mapping[str, Any] = {}
        self.model: Any = None  # records name its number types and devices

    @property
    def version(self) -> str:
        """The URL's option ``version``, else ``unknown``."""
        return self.options.version or "unknown"

    def begin(
        self,
        instruction: str,  # noqa: ARG002 - it is in the observations
        demonstration: Demonstration,  # noqa: ARG002
        seed: int = 0,
    ) -> CheckpointEpisode:
        """Load the checkpoint and begin an episode.

        Raises:
            MissingDependencyError: LeRobot, PyTorch or what the checkpoint needs is not installed.
            InvalidValueError: the checkpoint cannot be loaded.
        """
        loaded = self._loaded()
        model, self.metadata = loaded.model, loaded.metadata
        self.model = model
        before = dict(vars(model))
        for name, one in before.items():
            if callable(getattr(one, "reset", None)):  # such as what ensembles actions over time
                setattr(model, name, copy.copy(one))
        model.reset()
        # What the reset replaced, such as a queue of actions, belongs to the episode.
        own = {name: one for name, one in vars(model).items() if before.get(name) is not one}
        return CheckpointEpisode(seed, own)

    def act_batch(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation]
    ) -> list[NDArray[np.floating[Any]]]:
        """Return the checkpoint's next actions, (n, 8) for each episode."""
        import torch

        size = self._rows(self._loaded())
        chunks: list[NDArray[np.floating[Any]]] = []
        with torch.inference_mode():
            for start in range(0, len(states), size):
                stop = start + size
                chunks += self._ask(states[start:stop], observations[start:stop], size)
        return chunks

    def _loaded(self) -> LoadedCheckpoint:
        return load(self.place, self.options.device, self.options.execute)

    def _rows(self, loaded: LoadedCheckpoint) -> int:
        """Return how many episodes the model is asked about at once."""
        if loaded.noise is None and not loaded.is_noiseless:
            return 1  # the noise of an episode would depend on the others
        return self.options.batch or (1 if self.options.device == "cpu" else _BATCH)

    def _ask(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation], size: int
    ) -> list[NDArray[np.floating[Any]]]:
        """Ask the model about at most `size` episodes; the last one fills up the batch."""
        import torch

        loaded, count = self._loaded(), len(states)
        missing = size - count
        seeds = [state.next_seed() for state in states]
        torch.manual_seed(seeds[0])
        seen = [*observations, *[observations[-1]] * missing]
        batch = loaded.before(self._batch(loaded.sizes, seen))
        if size == 1:
            rows = _select(loaded, states[0], batch)
        else:
            rows = self._predict(loaded, [*seeds, *[seeds[-1]] * missing], batch)
        rows = torch.stack([loaded.after(rows[:, i]) for i in range(rows.shape[1])], dim=1)
        actions: NDArray[np.float64] = rows[:count].cpu().numpy().astype(np.float64)
        return list(actions)

    def _predict(
        self, loaded: LoadedCheckpoint, seeds: Sequence[int], batch: dict[str, Any]
    ) -> Any:  # noqa: ANN401 - a tensor
        """Return the chunks of several episodes, of which the model remembers nothing."""
        import torch

        options = {}
        if loaded.noise is not None:
            noise = [
                torch.randn(loaded.noise, generator=torch.Generator().manual_seed(seed))
                for seed in seeds
            ]
            options["noise"] = torch.stack(noise).to(self.options.device)
        return loaded.model.predict_action_chunk(batch, **options)[:, : loaded.steps]

    def _batch(
        self, sizes: Mapping[str, int | None], observations: Sequence[Observation]
    ) -> dict[str, Any]:
        """Return observations in LeRobot's form: pictures (n, 3, H, W) in [0, 1]."""
        import torch

        states = [np.append(one["joint_positions"], one["gripper"][0]) for one in observations]
        batch: dict[str, Any] = {
            STATE: torch.from_numpy(np.stack(states).astype(np.float32)),
            "task": [one["instruction"] for one in observations],
        }
        for camera, size in sizes.items():
            pictures = np.stack([_fit(one[f"{camera}_rgb"], size) for one in observations])  # type: ignore[literal-required]
            # In LeRobot's layout of memory, on which a model's rounding depends.
            channels_first = torch.from_numpy(pictures).permute(0, 3, 1, 2).contiguous()
            batch[PICTURE.format(camera)] = channels_first.float() / _MAX_BRIGHTNESS
        return {
            key: value if key == "task" else value.to(self.options.device)
            for key, value in batch.items()
        }


def _select(loaded: LoadedCheckpoint, state: CheckpointEpisode, batch: dict[str, Any]) -> Any:  # noqa: ANN401
    """Return the actions of one episode that no observation can change any more, (1, n, size)."""
    import torch

    model = loaded.model
    vars(model).update(state.memory)
    rows = [model.select_action(batch)]
    if loaded.remembered is not None:
        # The last ones wait for the observations that the next answer depends on.
        settled = _queue_length(model) - (loaded.remembered - 1)
        rows += [model.select_action(batch) for _ in range(settled)]
    state.memory.update({name: vars(model)[name] for name in state.memory})
    return torch.stack(rows, dim=1)


def _queue_length(model: Any) -> int:  # noqa: ANN401
    """Return how many actions a model has decided on and not yet returned."""
    queues = getattr(model, "_queues", None) or {}
    return len(queues.get("action", getattr(model, "_action_queue", ())))


def _fit(picture: NDArray[np.uint8], width: int | None) -> NDArray[np.uint8]:
    """Return a picture in the size that a checkpoint says; as it is, if that is no square."""
    return picture if width in (None, len(picture)) else scaled_square(picture, width)


@functools.cache
def load(place: str, device: str, execute: int | None = None) -> LoadedCheckpoint:
    """Load a checkpoint, once per process.

    Args:
        place: folder, or id of the Hub.
        device: of PyTorch.
        execute: actions of a chunk that are executed; None for what the checkpoint says.

    Raises:
        MissingDependencyError: LeRobot, PyTorch or what the checkpoint needs is not installed.
        InvalidValueError: the checkpoint cannot be loaded, or needs an input that does not exist.
    """
    try:
        return _load(place, device, execute)
    except ImportError as error:
        kind = "" if Path(place).is_dir() else " (no folder here, so an id of the Hub)"
        raise MissingDependencyError(
            f"{place!r}{kind} needs LeRobot 0.6 in an environment of its own with Python 3.12: see "
            f"docs/training.md ({error})."
        ) from error
    except (OSError, ValueError) as error:
        if isinstance(error, InvalidValueError):
            raise
        words = " ".join(f"{type(error).__name__}: {error}".split())
        raise InvalidValueError(
            f"The checkpoint {place!r} cannot be loaded: {words[:_MAX_WORDS]}"
        ) from error


def _load(place: str, device: str, execute: int | None) -> LoadedCheckpoint:
    from lerobot.configs.policies import PreTrainedConfig
    from lerobot.policies.factory import get_policy_class, make_pre_post_processors

    config = PreTrainedConfig.from_pretrained(place)
    config.device = device
    features = config.input_features or {}
    shapes = {name: getattr(one, "shape", None) for name, one in features.items()}
    sizes = picture_sizes(place, shapes)
    _set_steps(place, config, execute)
    model = get_policy_class(config.type).from_pretrained(place, config=config)
    before, after = make_pre_post_processors(
        config,
        pretrained_path=place,
        preprocessor_overrides={"device_processor": {"device": device}},
    )
    takes = inspect.signature(model.predict_action_chunk).parameters
    shape = getattr(config, "chunk_size", None), getattr(config, "max_action_dim", None)
    noise = (int(shape[0]), int(shape[1])) if "noise" in takes and None not in shape else None  # type: ignore[arg-type]
    is_single = getattr(config, "temporal_ensemble_coeff", None) is not None
    return LoadedCheckpoint(
        model.to(device).eval(), before, after, sizes, noise,
        is_noiseless=config.type in _NOISELESS and not is_single,
        steps=getattr(config, "n_action_steps", None),
        remembered=config.n_obs_steps if config.type in _QUEUED else None,
        metadata=_describe(config, _step_names(before), _step_names(after, of_actions=True)),
    )  # fmt: skip


def _set_steps(place: str, config: Any, execute: int | None) -> None:  # noqa: ANN401
    """Let a configuration execute another number of actions, without ensembling."""
    if execute is None:
        return
    longest = getattr(config, "chunk_size", None)
    if longest is None:
        longest = getattr(config, "horizon", 0) - config.n_obs_steps + 1
    if not hasattr(config, "n_action_steps"):
        raise InvalidValueError(
            f"execute is {execute}, but how many actions {place!r} executes is part of its "
            f"training (type {config.type!r}); leave it out."
        )
    if execute > longest:
        raise InvalidValueError(
            f"execute is {execute}; {place!r} plans {longest} actions, so it can be 1 to {longest}."
        )
    config.n_action_steps = execute
    if hasattr(config, "temporal_ensemble_coeff"):
        config.temporal_ensemble_coeff = None


def _describe(config: Any, before: Sequence[str], after: Sequence[str]) -> dict[str, Any]:  # noqa: ANN401
    """Return a checkpoint's metadata, from its configuration and the steps of its processors."""
    inputs = [
        f"{name} {getattr(one, 'shape', '')}".strip()
        for name, one in (config.input_features or {}).items()
    ]
    found: dict[str, Any] = {
        "preprocessing": f"the checkpoint declares the inputs {', '.join(inputs)}; roboirg resizes "
        "pictures from 256 × 256 pixels to the declared height and width, if these are another "
        "square (whether training did likewise: not reported by the checkpoint), and scales their "
        "brightness to [0, 1], the range in which LeRobot's datasets deliver pictures; then the "
        "preprocessor that training saved with it is applied to all inputs, in the steps "
        f"{', '.join(before) or 'none'}; its postprocessor is applied to the actions, in the steps "
        f"{', '.join(after) or 'none'}"
    }
    tokenizers = [name for name in before if "tokenizer" in name]
    if tokenizers:
        found |= {"reads_text": "yes", "text_normalization": ", ".join(tokenizers)}
    elif config.type in _WORDLESS:
        found["reads_text"] = f"no, a policy of type {config.type} has no input for text"
    sizes = {"chunk": "chunk_size", "execute": "n_action_steps"}
    return found | {key: vars(config)[one] for key, one in sizes.items() if one in vars(config)}


def _step_names(processor: object, *, of_actions: bool = False) -> list[str]:
    """Return the names of a processor's steps; normalizers with what they normalize, and how."""
    found = []
    for step in getattr(processor, "steps", ()):
        modes = step.get_config().get("norm_map", {})
        own = [f"{one} {mode}" for one, mode in modes.items() if (one == "ACTION") == of_actions]
        name = getattr(step, "_registry_name", type(step).__name__)
        found.append(f"{name} ({', '.join(own)})" if own else name)
    return found
