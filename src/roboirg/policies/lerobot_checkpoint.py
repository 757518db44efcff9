"""What a checkpoint of LeRobot says of itself, read from its files without LeRobot."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import CAMERAS

PICTURE = "observation.images.{}"
STATE = "observation.state"
_CONFIG = "config.json"
_FILES = (_CONFIG, "model.safetensors", "policy_preprocessor.json", "policy_postprocessor.json")
_TRAINED = "checkpoints/last/pretrained_model"
"""Where lerobot-train puts a checkpoint in its output folder."""
_HUB_ID = re.compile(r"\w[\w.-]*/\w[\w.-]*")


class CheckpointFacts(NamedTuple):
    """What a checkpoint takes.

    Attributes:
        sizes: width of its square pictures by camera, pixels; None where it declares no square.
        prompt_tokens: that it reads of a prompt; None if it says none.
    """

    sizes: Mapping[str, int | None]
    prompt_tokens: int | None = None


UNKNOWN = CheckpointFacts(dict.fromkeys(CAMERAS))
"""Of a checkpoint that is not on this computer."""


def read_facts(place: str) -> CheckpointFacts:
    """Return what a checkpoint takes; of one that is not on this computer, `UNKNOWN`.

    Args:
        place: a folder, or the id of a repository of the Hub; nothing is downloaded.

    Raises:
        InvalidValueError: there is no such folder, it holds no checkpoint, or the checkpoint needs
            an input that does not exist.
    """
    path = _local_config(place)
    if path is None:
        return UNKNOWN
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
        shapes = {name: one.get("shape") for name, one in (config["input_features"] or {}).items()}
        is_policy = isinstance(config["type"], str)
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        is_policy = False
    if not is_policy:
        raise InvalidValueError(
            f"{str(path)!r} does not describe a LeRobot policy: it must be JSON with `type` and "
            "`input_features`."
        )
    limit = config.get("tokenizer_max_length")
    return CheckpointFacts(
        picture_sizes(place, shapes), limit if isinstance(limit, int) and limit > 0 else None
    )


def picture_sizes(place: str, shapes: Mapping[str, object]) -> dict[str, int | None]:
    """Return the width of the square pictures that a checkpoint takes, by camera; else None.

    Args:
        place: of the checkpoint.
        shapes: of its inputs by name.

    Raises:
        InvalidValueError: one of them does not exist here.
    """
    names = {PICTURE.format(camera): camera for camera in CAMERAS}
    for name in shapes:
        if name.startswith("observation.") and name not in (STATE, *names):
            raise InvalidValueError(
                f"The checkpoint {place!r} needs {name!r}; there are {', '.join((STATE, *names))}."
            )
    return {camera: _width(shapes[name]) for name, camera in names.items() if name in shapes}


def _width(shape: object) -> int | None:
    """Return the width of a square picture's shape (3, width, width), or None."""
    match shape:
        case [_, int(height), int(width)] if height == width > 0:
            return width
    return None


def _local_config(place: str) -> Path | None:
    """Return the configuration of a checkpoint; None if it is not on this computer."""
    folder = Path(place)
    if folder.is_dir():
        _check_folder(folder)
        return folder / _CONFIG
    is_id = _HUB_ID.fullmatch(place) is not None
    if folder.exists() or not is_id or folder.parent.is_dir():
        raise InvalidValueError(
            f"There is no folder {place!r}; lerobot:// takes the folder of a checkpoint, such as "
            f"outputs/act/{_TRAINED}, or an id of the Hub, OWNER/NAME."
        )
    try:
        from huggingface_hub import try_to_load_from_cache

        cached: Any = try_to_load_from_cache(place, _CONFIG)
    except (ImportError, ValueError):  # not installed, or no name of a repository
        return None
    return Path(cached) if isinstance(cached, str) else None


def _check_folder(folder: Path) -> None:
    """Raise unless a folder holds a whole checkpoint."""
    for name in _FILES:
        if not (folder / name).is_file():
            raise InvalidValueError(
                f"The folder {str(folder)!r} has no {name}; a checkpoint of LeRobot holds "
                f"{', '.join(_FILES)}, and lerobot-train puts it into {_TRAINED}."
            )
