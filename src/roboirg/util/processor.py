"""What the system tells of its processor."""

from __future__ import annotations

import functools
import os
import platform
from pathlib import Path

_FAMILY = ("vendor_id", "cpu family", "CPU implementer", "CPU architecture")
"""Of x86 the first two, of ARM the others."""


def processor_model() -> str:
    """Return the model of the processor; empty where the system does not tell."""
    return _fields().get("model name", platform.processor())


def processor_family() -> str:
    """Return architecture, maker and family, such as ``x86_64 GenuineIntel 6``.

    Processors of one family round alike: the physics engine uses approximate reciprocals and roots,
    in which makers differ.
    """
    fields = _fields()
    told = [fields[name] for name in _FAMILY if name in fields] or [platform.processor()]
    return " ".join([platform.machine(), *told]).strip()


def processor_features() -> str:
    """Return model and instruction sets, which decide the last bits of sines and cosines."""
    fields = _fields()
    told = [fields[name] for name in ("model name", "flags", "Features") if name in fields]
    return "\n".join(told or [platform.processor()])


@functools.cache
def _fields() -> dict[str, str]:
    """Return what Linux tells of the first processor; empty elsewhere."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    return {line.partition(":")[0].strip(): line.partition(":")[2].strip() for line in lines[::-1]}


def core_count() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
