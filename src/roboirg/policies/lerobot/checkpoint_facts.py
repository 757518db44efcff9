"""What a checkpoint of LeRobot says of itself, read from its files without LeRobot."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import CAMERAS
from roboirg.policies.contract.policy_version import CHECKPOINT_FILE
from roboirg.util.regular_file import read_regular

PICTURE = "observation.images.{}"
STATE = "observation.state"


class CheckpointFacts(NamedTuple):
    """What a checkpoint takes.

    Attributes:
        sizes: width of its square pictures by camera, pixels; None where it declares no square.
        prompt_tokens: that it reads of a prompt; None if it says none.
    """

    sizes: Mapping[str, int | None]
    prompt_tokens: int | None = None


UNKNOWN = CheckpointFacts(dict.fromkeys(CAMERAS))
"""Of a checkpoint whose configuration is not on this computer, or not as LeRobot writes it."""


def read_facts(place: str) -> CheckpointFacts:
    """Return what a checkpoint takes, as far as its configuration is on this computer.

    That is in a folder, or in the cache of the Hub. Without it, or if it cannot be read, `UNKNOWN`
    is returned, and what is wrong shows when the checkpoint is loaded.

    Args:
        place: a folder, or the id of a repository of the Hub; nothing is downloaded.

    Raises:
        InvalidValueError: the checkpoint needs an input that does not exist.
    """
    try:
        config = json.loads(read_regular(_configuration_file(place)))
        features = config["input_features"]
        shapes = {name: feature.get("shape") for name, feature in features.items()}
        limit = config.get("tokenizer_max_length")
    except (ImportError, OSError, ValueError, TypeError, KeyError, AttributeError):
        return UNKNOWN  # LeRobot names what is wrong where it loads the checkpoint
    sizes = picture_sizes(place, shapes)
    if isinstance(limit, int) and limit > 0:
        return CheckpointFacts(sizes, limit)
    return CheckpointFacts(sizes)


def _configuration_file(place: str) -> Path:
    """Return where a checkpoint's configuration is or should be: here, or in the Hub's cache."""
    path = Path(place) / CHECKPOINT_FILE
    if path.is_file():
        return path
    from huggingface_hub import try_to_load_from_cache

    return Path(str(try_to_load_from_cache(place, CHECKPOINT_FILE)))


def picture_sizes(place: str, shapes: Mapping[str, object]) -> dict[str, int | None]:
    """Return the cameras whose pictures a checkpoint takes, each with the width of the picture.

    The width is None if the checkpoint declares none, or pictures that are not square.

    Args:
        place: of the checkpoint.
        shapes: of its inputs by name.

    Raises:
        InvalidValueError: one of them does not exist here.
    """
    cameras = {PICTURE.format(camera): camera for camera in CAMERAS}
    inputs = [STATE, *cameras]
    for name in shapes:
        if name.startswith("observation.") and name not in inputs:
            raise InvalidValueError(
                f"The checkpoint {place!r} needs {name!r}; there are {', '.join(inputs)}."
            )
    return {camera: _width(shapes[name]) for name, camera in cameras.items() if name in shapes}


def _width(shape: object) -> int | None:
    """Return the width of a square picture's shape (3, width, width), or None."""
    match shape:
        case [_, int(height), int(width)] if height == width > 0:
            return width
    return None
