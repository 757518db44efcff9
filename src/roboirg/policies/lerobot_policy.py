"""lerobot://path-or-hub-id: policies trained with LeRobot, in this process.

A checkpoint declares its inputs. Its names are those of LeRobot's data sets of this robot:
``observation.images.front``, ``observation.images.wrist``, ``observation.state`` (seven joints and
the first finger) and the text ``task``. Its actions are absolute joint targets and the gripper, +1
open to -1 closed.
"""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.policies.contract.policy_urls import UrlOptions, read_options, split_url

PICTURE = "observation.images.{}"
STATE = "observation.state"
_MAX_BRIGHTNESS = 255.0
_BATCH = 8
_NOISELESS = frozenset({"act"})
"""Types of checkpoints that draw no noise when they act."""
_WORDLESS = frozenset({"act", "diffusion", "tdmpc", "vqbet"})
"""Types of checkpoints that have no input for text."""
_CONFIG = "config.json"


class LeRobotPolicyOptions(UrlOptions):
    """Options of lerobot://.

    Attributes:
        device: of PyTorch.
        batch: episodes that the checkpoint is asked about at once; None for 1 on the CPU, else 8.
        execute: actions of a chunk that are executed; None for all.
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
        noise: shape of the noise that the model takes for each episode; None if it takes none.
        is_noiseless: whether it is known to draw none either.
        metadata: how its inputs and outputs are processed, for records.
    """

    model: Any
    before: Callable[[dict[str, Any]], dict[str, Any]]
    after: Callable[[Any], Any]
    noise: tuple[int, int] | None = None
    is_noiseless: bool = False
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

    cameras: ClassVar[tuple[str, ...]] = CAMERAS
    demonstration_frames: ClassVar[str] = "none"

    def __init__(self, url: str, seed: int = 0) -> None:
        del seed
        parts = split_url(url)
        self.options = read_options(parts, LeRobotPolicyOptions)
        self.place = parts.place
        self.prompt_tokens = self.options.prompt_tokens or read_prompt_tokens(parts.place)
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
            MissingDependencyError: LeRobot or PyTorch is not installed.
            InvalidValueError: the checkpoint needs an input that does not exist.
        """
        loaded = load(self.place, self.options.device)
        model, self.metadata = loaded.model, loaded.metadata
        self.model = model
        before = dict(vars(model))
        model.reset()
        # What the reset replaced, such as a queue of actions, belongs to the episode.
        own = {name: one for name, one in vars(model).items() if before.get(name) is not one}
        return CheckpointEpisode(seed, own)

    def act_batch(
        self, states: Sequence[CheckpointEpisode], observations: Sequence[Observation]
    ) -> list[NDArray[np.floating[Any]]]:
        """Return the checkpoint's next actions, (n, 8) for each episode."""
        import torch

        size = self._rows(load(self.place, self.options.device))
        chunks: list[NDArray[np.floating[Any]]] = []
        with torch.inference_mode():
            for start in range(0, len(states), size):
                stop = start + size
                chunks += self._ask(states[start:stop], observations[start:stop], size)
        return chunks

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

        loaded, count = load(self.place, self.options.device), len(states)
        missing = size - count
        seeds = [state.next_seed() for state in states]
        batch = loaded.before(self._batch([*observations, *[observations[-1]] * missing]))
        options = {}
        if loaded.noise is None or size == 1:
            torch.manual_seed(seeds[0])
        else:
            noise = [
                torch.randn(loaded.noise, generator=torch.Generator().manual_seed(seed))
                for seed in [*seeds, *[seeds[-1]] * missing]
            ]
            options["noise"] = torch.stack(noise).to(self.options.device)
        model = loaded.model
        # Asked about several episodes at once, the model remembers none of them.
        memory = states[0].memory if size == 1 else {}
        vars(model).update(memory)
        try:
            rows = model.predict_action_chunk(batch, **options)
        except NotImplementedError:  # a policy without chunks
            rows = model.select_action(batch)[:, None]
        memory.update({name: vars(model)[name] for name in memory})
        rows = torch.stack([loaded.after(rows[:, i]) for i in range(rows.shape[1])], dim=1)
        actions: NDArray[np.float64] = rows[:count].cpu().numpy().astype(np.float64)
        return list(actions[:, : self.options.execute])

    def _batch(self, observations: Sequence[Observation]) -> dict[str, Any]:
        """Return observations in LeRobot's form: pictures (n, 3, H, W) in [0, 1]."""
        import torch

        states = [np.append(one["joint_positions"], one["gripper"][0]) for one in observations]
        batch: dict[str, Any] = {
            STATE: torch.from_numpy(np.stack(states).astype(np.float32)),
            "task": [one["instruction"] for one in observations],
        }
        for camera in CAMERAS:
            pictures = np.stack([one[f"{camera}_rgb"] for one in observations])  # type: ignore[literal-required]
            batch[PICTURE.format(camera)] = (
                torch.from_numpy(pictures).permute(0, 3, 1, 2).float() / _MAX_BRIGHTNESS
            )
        return {
            key: value if key == "task" else value.to(self.options.device)
            for key, value in batch.items()
        }


@functools.cache
def load(place: str, device: str) -> LoadedCheckpoint:
    """Load a checkpoint, once per process.

    Raises:
        MissingDependencyError: LeRobot or PyTorch is not installed.
        InvalidValueError: the checkpoint needs an input that does not exist.
    """
    try:
        from lerobot.configs.policies import PreTrainedConfig
        from lerobot.policies.factory import get_policy_class, make_pre_post_processors
    except ImportError as error:
        raise MissingDependencyError(
            f"lerobot:// needs LeRobot with PyTorch; run pip install lerobot ({error})."
        ) from error
    config = PreTrainedConfig.from_pretrained(place)
    config.device = device
    _check_features(place, config.input_features or {})
    model = get_policy_class(config.type).from_pretrained(place, config=config)
    before, after = make_pre_post_processors(
        config,
        pretrained_path=place,
        preprocessor_overrides={"device_processor": {"device": device}},
    )
    takes = inspect.signature(model.predict_action_chunk).parameters
    shape = getattr(config, "chunk_size", None), getattr(config, "max_action_dim", None)
    noise = (int(shape[0]), int(shape[1])) if "noise" in takes and None not in shape else None  # type: ignore[arg-type]
    return LoadedCheckpoint(
        model.to(device).eval(),
        before,
        after,
        noise,
        config.type in _NOISELESS,
        _describe(config, _step_names(before), _step_names(after)),
    )


def _describe(config: Any, before: Sequence[str], after: Sequence[str]) -> dict[str, Any]:  # noqa: ANN401
    """Return a checkpoint's metadata, from its configuration and the steps of its processors."""
    inputs = [
        f"{name} {getattr(one, 'shape', '')}".strip()
        for name, one in (config.input_features or {}).items()
    ]
    found: dict[str, Any] = {
        "preprocessing": f"inputs {', '.join(inputs)}; pictures scaled to [0, 1], as in LeRobot's "
        "data sets; then the checkpoint's own steps, saved with it in training: "
        f"{', '.join(before) or 'none'}; on its actions: {', '.join(after) or 'none'}"
    }
    tokenizers = [name for name in before if "tokenizer" in name]
    if tokenizers:
        found |= {"reads_text": "yes", "text_normalization": ", ".join(tokenizers)}
    elif config.type in _WORDLESS:
        found["reads_text"] = f"no, a policy of type {config.type} has no input for text"
    chunk = getattr(config, "chunk_size", None)
    return found if chunk is None else {**found, "chunk": chunk}


def _step_names(processor: object) -> list[str]:
    """Return the names of a processor's steps; normalizers with what they normalize, and how."""
    found = []
    for step in getattr(processor, "steps", ()):
        modes = step.get_config().get("norm_map", {})
        listed = ", ".join(f"{kind} {mode}" for kind, mode in modes.items())
        name = getattr(step, "_registry_name", type(step).__name__)
        found.append(f"{name} ({listed})" if listed else name)
    return found


def read_prompt_tokens(place: str) -> int | None:
    """Return the limit in a checkpoint's configuration.

    None if it has none, or if it is not on this computer: nothing is downloaded.
    """
    path: Path | str | None = Path(place) / _CONFIG
    if not Path(place).is_dir():
        try:
            from huggingface_hub import try_to_load_from_cache

            path = try_to_load_from_cache(place, _CONFIG)
        except (ImportError, ValueError):  # not installed, or no name of a repository
            return None
    try:
        config = json.loads(Path(path).read_text(encoding="utf-8"))  # type: ignore[arg-type]
        limit = config.get("tokenizer_max_length")
    except (OSError, ValueError, TypeError, AttributeError):  # loading it says more
        return None
    return limit if isinstance(limit, int) and limit > 0 else None


def _check_features(place: str, features: dict[str, Any]) -> None:
    """Raise if the checkpoint needs an input that does not exist."""
    known = [STATE, *(PICTURE.format(camera) for camera in CAMERAS)]
    for name in features:
        if name.startswith("observation.") and name not in known:
            raise InvalidValueError(
                f"The checkpoint {place!r} needs {name!r}; there are {', '.join(known)}."
            )
