"""What all that is learned needs: PyTorch and safetensors."""

from __future__ import annotations

from roboirg.extension.commands import MissingDependencyError


def check_learn_support() -> None:
    """Check early that PyTorch and safetensors are there, and let PyTorch use one thread.

    Networks this small are slower on two as soon as anything else runs.
    """
    try:
        import safetensors  # noqa: F401 - only whether it is there
        import torch
    except ImportError as error:
        raise MissingDependencyError(
            f"What is learned needs PyTorch and safetensors, which cannot be imported ({error}); "
            "run: pip install torch safetensors"
        ) from error
    torch.set_num_threads(1)
