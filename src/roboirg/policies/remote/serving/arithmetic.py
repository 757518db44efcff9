"""What decides the last bits of a server's numbers: its device, the driver, and flags."""

from __future__ import annotations

import functools
import os
import platform
import subprocess

FLAG_VARIABLES = (
    "XLA_FLAGS",
    "JAX_DEFAULT_MATMUL_PRECISION",
    "CUBLAS_WORKSPACE_CONFIG",
    "NVIDIA_TF32_OVERRIDE",
    "TORCH_ALLOW_TF32_CUBLAS_OVERRIDE",
    "TF_DETERMINISTIC_OPS",
)
"""Environment variables that choose kernels or their precision."""
TIMEOUT_S = 30.0


def describe_arithmetic() -> dict[str, str]:
    """Return ``device``, ``driver`` if there is one, and ``flags`` if some are set."""
    flags = [f"{name}={os.environ[name]}" for name in FLAG_VARIABLES if os.environ.get(name)]
    return {**_device(), **({"flags": " ".join(flags)} if flags else {})}


@functools.cache
def _device() -> dict[str, str]:
    command = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
    try:
        told = subprocess.check_output(command, text=True, timeout=TIMEOUT_S)  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        told = ""
    rows = [line.rpartition(", ") for line in told.splitlines()]
    if not rows:
        return {"device": f"{platform.machine()} processor"}
    names, drivers = ([row[end] for row in rows] for end in (0, 2))
    return {"device": ", ".join(names), "driver": drivers[0]}
