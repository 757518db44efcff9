"""What all that is learned needs: PyTorch, and fingerprints of files."""

from __future__ import annotations

from pathlib import Path

from roboirg.extension.commands import InvalidValueError, MissingDependencyError, short_hash


def check_learn_support() -> None:
    """Check early that PyTorch is there, and let it use one thread.

    Networks this small are slower on two as soon as anything else runs.
    """
    try:
        import torch
    except ImportError as error:
        raise MissingDependencyError(
            f"What is learned needs PyTorch, which cannot be imported ({error}); "
            "run: pip install torch"
        ) from error
    torch.set_num_threads(1)


def file_version(path: Path, kind: str) -> str:
    """Return a fingerprint of a file that was learned.

    Args:
        path: the file.
        kind: what it is: ``listener`` or ``policy``.

    Raises:
        InvalidValueError: it cannot be read.
    """
    try:
        return short_hash(path.read_bytes())
    except OSError as error:
        raise InvalidValueError(
            f"The trained {kind} {str(path)!r} cannot be read ({error.strerror}); make one with: "
            f"roboirg learn {kind} --out PATH."
        ) from error
