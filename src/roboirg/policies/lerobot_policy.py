"""lerobot://path-or-hub-id: policies trained with LeRobot, in this process.

A checkpoint declares its inputs. Its names are those of LeRobot's data sets of this robot:
``observation.images.front``, ``observation.images.wrist``, ``observation.state`` (seven joints and
the first finger) and the text ``task``. Its actions are absolute joint targets and the gripper, +1
open to -1 closed.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.core.observations import CAMERAS, Demonstration, Observation
from roboirg.policies.policy_urls import UrlOptions, read_options, split_url

PICTURE = "observation.images.{}"
STATE = "observation.state"
_MAX_BRIGHTNESS = 255.0


class LeRobotPolicyOptions(UrlOptions):
    """Options of lerobot://.

    Attributes:
        device: of PyTorch.
        execute: actions of a chunk that are executed; None for all.
        version: of the checkpoint, for the records.
    """

    device: str = Field("cpu", min_length=1)
    execute: int | None = Field(None, ge=1)
    version: str | None = Field(None, min_length=1)


class LoadedCheckpoint(NamedTuple):
    """A checkpoint in memory.

    Attributes:
        model: LeRobot's policy.
        before: turns a batch into the model's inputs.
        after: turns the model's outputs into actions.
    """

    model: Any
    before: Callable[[dict[str, Any]], dict[str, Any]]
    after: Callable[[Any], Any]


class LeRobotPolicy:
    """A checkpoint of LeRobot, loaded at the first reset, once per process.

    Args:
        url: path or hub id, and options.
        seed: of PyTorch's generator, from each reset on.

    Raises:
        UnknownNameError: the URL has an unknown option.
        InvalidValueError: an option has a wrong value.
    """

    cameras: ClassVar[tuple[str, ...]] = CAMERAS
    demonstration_frames: ClassVar[str] = "none"

    def __init__(self, url: str, seed: int = 0) -> None:
        parts = split_url(url)
        self.options = read_options(parts, LeRobotPolicyOptions)
        self._place, self._seed = parts.place, seed

    @property
    def version(self) -> str:
        """The URL's option ``version``, else ``unknown``."""
        return self.options.version or "unknown"

    def reset(self, instruction: str, demonstration: Demonstration) -> None:  # noqa: ARG002
        """Load the checkpoint and begin an episode.

        Raises:
            MissingDependencyError: LeRobot or PyTorch is not installed.
            InvalidValueError: the checkpoint needs an input that does not exist.
        """
        import torch

        self._loaded = load(self._place, self.options.device)
        self._loaded.model.reset()
        torch.manual_seed(self._seed)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the checkpoint's next actions, (n, 8)."""
        import torch

        with torch.inference_mode():
            batch = self._loaded.before(self._batch(observation))
            try:
                rows = self._loaded.model.predict_action_chunk(batch)
            except NotImplementedError:  # a policy without chunks
                rows = self._loaded.model.select_action(batch)[:, None]
            rows = torch.stack(
                [self._loaded.after(rows[:, index]) for index in range(rows.shape[1])], dim=1
            )
        actions: NDArray[np.float64] = rows[0].cpu().numpy().astype(np.float64)
        return actions[: self.options.execute]

    def _batch(self, observation: Observation) -> dict[str, Any]:
        """Return an observation in LeRobot's form: pictures (1, 3, H, W) in [0, 1]."""
        import torch

        state = np.append(observation["joint_positions"], observation["gripper"][0])
        batch: dict[str, Any] = {
            STATE: torch.from_numpy(state.astype(np.float32))[None],
            "task": [observation["instruction"]],
        }
        for camera in CAMERAS:
            picture = torch.from_numpy(np.array(observation[f"{camera}_rgb"]))  # type: ignore[literal-required]
            batch[PICTURE.format(camera)] = picture.permute(2, 0, 1)[None].float() / _MAX_BRIGHTNESS
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
    return LoadedCheckpoint(model.to(device).eval(), before, after)


def _check_features(place: str, features: dict[str, Any]) -> None:
    """Raise if the checkpoint needs an input that does not exist."""
    known = [STATE, *(PICTURE.format(camera) for camera in CAMERAS)]
    for name in features:
        if name.startswith("observation.") and name not in known:
            raise InvalidValueError(
                f"The checkpoint {place!r} needs {name!r}; there are {', '.join(known)}."
            )
