"""Files of what was learned: tensors, and a description as JSON, of which nothing is executed."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import torch
from safetensors import safe_open
from safetensors.torch import save
from torch import Tensor, nn

from roboirg.extension.commands import InvalidValueError, short_hash, write_atomically

FORMAT = 1
"""Version of the layout of the files."""
DESCRIPTION = "roboirg"
"""Key of a file's metadata under which its description stands."""
END = ".safetensors"
"""Of the names of these files."""
Trained = TypeVar("Trained")


class TrainedFile(NamedTuple):
    """The content of a file of trained networks.

    Attributes:
        about: what is needed to make the networks, as plain data; its ``plan`` says how they were
            trained.
        tensors: by name; those of a network begin with its name and a dot.
    """

    about: dict[str, Any]
    tensors: dict[str, Tensor]

    @property
    def version(self) -> str:
        """Fingerprint of plan, tensors' names and numbers; the file's layout does not change it."""
        content = json.dumps(self.about["plan"], sort_keys=True)
        for name, tensor in sorted(self.tensors.items()):
            numbers = short_hash(tensor.numpy().tobytes())
            content += f"\n{name} {tensor.dtype} {list(tensor.shape)} {numbers}"
        return short_hash(content)

    def load(self, nets: nn.ModuleDict) -> None:
        """Load the file's weights into networks, by their names, and set them to evaluation.

        ``detector.scores.bias`` is a weight of the network ``detector``. A name without a dot, such
        as ``heights``, is no weight, but another tensor that the file keeps.
        """
        weights = {name: tensor for name, tensor in self.tensors.items() if "." in name}
        nets.load_state_dict(weights)
        nets.eval()


def save_trained(
    kind: str,
    about: Mapping[str, Any],
    nets: nn.ModuleDict,
    tensors: Mapping[str, Tensor],
    path: Path,
) -> None:
    """Write trained networks to a file, whole or not at all; `load_trained` reads it.

    Args:
        kind: what it is: ``listener``, ``body`` or ``reader``.
        about: as in `TrainedFile`.
        nets: the networks by their names.
        tensors: other numbers, by names without dots.
        path: of the file.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    description = json.dumps({"kind": kind, "format": FORMAT, **about})
    content = {**tensors, **nets.state_dict()}
    write_atomically(path, save(content, {DESCRIPTION: description}))


def load_trained(path: Path, kind: str, read: Callable[[TrainedFile], Trained]) -> Trained:
    """Load a file of `save_trained`, and return what `read` makes of its content.

    Args:
        path: the file.
        kind: what it must be: ``listener``, ``body`` or ``reader``.
        read: builds the networks and loads their weights; whatever it raises means a damaged file.

    Raises:
        InvalidValueError: the file is none of that kind.
    """
    try:
        with safe_open(path, framework="pt") as file:
            about = json.loads(file.metadata()[DESCRIPTION])
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        found = f"{about['kind']} of format {about['format']}"
        if found != f"{kind} of format {FORMAT}":
            raise InvalidValueError(f"it is a {found}")
        return read(TrainedFile(about, tensors))
    except Exception as error:
        raise InvalidValueError(
            f"{str(path)!r} is no trained {kind} ({_reason(error)}); roboirg learn makes one."
        ) from error


def _reason(error: Exception) -> str:
    """Return why a file could not be loaded, for the middle of a message, without full stop."""
    if isinstance(error, (OSError, InvalidValueError)):
        return str(error).removesuffix(".")
    return "it is damaged, or was not written by this version"


def save_checkpoint(content: Mapping[str, Any], path: Path) -> None:
    """Write the state of an unfinished training, whole or not at all.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    file = io.BytesIO()
    torch.save(dict(content), file)
    write_atomically(path, file.getvalue())


def load_checkpoint(path: Path, made_of: object) -> dict[str, Any] | None:
    """Return the state of an unfinished training, as `save_checkpoint` wrote it.

    None if there is no file, or if it is of another training: one with another `made_of`, all that
    the result depends on. A file without `made_of` is of another training, too.

    Raises:
        InvalidValueError: the file cannot be read.
    """
    try:
        content: dict[str, Any] = torch.load(path, weights_only=True)
    except FileNotFoundError:
        return None
    except Exception as error:
        raise InvalidValueError(
            f"{str(path)!r} cannot be read ({type(error).__name__}); delete it to learn it again."
        ) from error
    return content if content.get("made_of") == made_of else None
