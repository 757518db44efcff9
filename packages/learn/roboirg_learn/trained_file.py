"""Files of what was learned: plain tensors and data, of which nothing is executed."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import nn

from roboirg.extension.commands import InvalidValueError, write_atomically

Trained = TypeVar("Trained")


def save_trained(content: Mapping[str, Any], path: Path) -> None:
    """Write what was learned, whole or not at all.

    Raises:
        InvalidValueError: the file cannot be written.
    """
    file = io.BytesIO()
    torch.save(dict(content), file)
    write_atomically(path, file.getvalue())


def load_unfinished(path: Path, made_of: object) -> dict[str, Any] | None:
    """Return what was learned on the way; None unless it was made of the same."""
    try:
        content: dict[str, Any] = torch.load(path, weights_only=True)
    except FileNotFoundError:
        return None
    except Exception as error:
        raise InvalidValueError(
            f"{str(path)!r} cannot be read ({type(error).__name__}); delete it to learn it again."
        ) from error
    return content if content.get("made_of") == made_of else None


def load_nets(nets: Mapping[str, nn.Module], content: Mapping[str, Any]) -> None:
    """Give networks the weights that a file has under their names, ready to be used."""
    for name, net in nets.items():
        net.load_state_dict(content[name])
        net.eval()


def load_trained(
    path: Path, kind: str, file_format: str, read: Callable[[Mapping[str, Any]], Trained]
) -> Trained:
    """Return what was learned.

    Args:
        path: the file.
        kind: what it is: ``listener`` or ``policy``.
        file_format: that the file must name as its ``format``.
        read: makes the result of the file's content.

    Raises:
        InvalidValueError: the file is none of that kind.
    """
    try:
        content = torch.load(path, weights_only=True, map_location="cpu")
        found = content.get("format") if isinstance(content, dict) else None
        if found != file_format:
            raise InvalidValueError(f"its format is not {file_format!r}, but {found!r}")
        return read(content)
    except Exception as error:
        raise InvalidValueError(
            f"{str(path)!r} is no trained {kind} ({_reason(error)}); "
            f"make one with: roboirg learn {kind}."
        ) from error


def _reason(error: Exception) -> str:
    """Return in a few words why a file could not be loaded."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    if isinstance(error, InvalidValueError):
        return str(error).splitlines()[0].removesuffix(".")
    return "it is damaged, or was not written by this version"
