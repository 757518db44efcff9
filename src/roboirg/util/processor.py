"""The processor, and how many of its cores are used."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import platform
from collections.abc import Iterator, Sequence
from pathlib import Path

from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import check_whole

WORKERS_VARIABLE = "ROBOIRG_WORKERS"
"""Environment variable with the number of worker processes of commands."""

WORKERS_OF_A_GPU = 8
"""Workers that one GPU serves best if their policy wants every picture (docs/performance.md)."""

_CPU_QUOTAS = (
    ("/sys/fs/cgroup/cpu.max",),
    ("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "/sys/fs/cgroup/cpu/cpu.cfs_period_us"),
)
"""Files with the microseconds of processor time in a period, and those of the period."""
_FAMILY = ("vendor_id", "cpu family", "CPU implementer", "CPU architecture")
"""Of x86 the first two, of ARM the others."""


def processor_family() -> str:
    """Return architecture, maker and family, such as ``x86_64 GenuineIntel 6``.

    Processors of one family round alike: the physics engine uses approximate reciprocals and roots,
    in which makers differ.
    """
    described = _described_by(_FAMILY)
    return " ".join([platform.machine(), *described]).strip()


def processor_features() -> str:
    """Return model and instruction sets, which decide the last bits of sines and cosines."""
    return "\n".join(_described_by(("model name", "flags", "Features")))


def _described_by(names: Sequence[str]) -> list[str]:
    """Return the values of these fields that Linux has; Python's name of the processor without any.

    ``("vendor_id", "cpu family")`` -> ``["GenuineIntel", "6"]``.

    Args:
        names: of fields of ``/proc/cpuinfo``.
    """
    fields = _fields()
    values = [fields[name] for name in names if name in fields]
    return values or [platform.processor()]


@functools.cache
def _fields() -> dict[str, str]:
    """Return what Linux says of the first processor: ``{"model name": "…"}``; empty elsewhere."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    fields: dict[str, str] = {}
    for line in text.splitlines():
        name, _, value = line.partition(":")
        fields.setdefault(name.strip(), value.strip())
    return fields


def core_count() -> int:
    """Return how many cores this process may use, within the limit of its container; at least 1."""
    if not hasattr(os, "sched_getaffinity"):
        return os.cpu_count() or 1
    limits = [len(os.sched_getaffinity(0)), *_quotas()]
    return max(1, math.ceil(min(limits)))


def worker_advice() -> str:
    """Return how many workers suit this machine, as words."""
    if core_count() <= WORKERS_OF_A_GPU:
        return "one per core"
    return (
        f"one per core, or about {WORKERS_OF_A_GPU} per GPU that renders if the policy wants every "
        "picture"
    )


def _quotas() -> Iterator[float]:
    """Yield the limit of a container's processor time in cores, as each version of cgroups has it.

    A quota of 150000 in a period of 100000 microseconds are 1.5 cores.
    """
    for names in _CPU_QUOTAS:
        with contextlib.suppress(OSError, ValueError, ZeroDivisionError):  # no file, or no numbers
            texts = [Path(name).read_text() for name in names]
            quota, period = " ".join(texts).split()
            # Without a limit, the quota is "max", which is no number, or -1.
            if float(quota) > 0:
                yield float(quota) / float(period)


def worker_count(typed: int | None = None) -> int:
    """Return how many worker processes a command uses; 0 is this process only.

    Args:
        typed: as typed; None for the number in ``ROBOIRG_WORKERS``, or one per core without it.

    Raises:
        InvalidValueError: the number is negative, or the variable does not hold one.
    """
    if typed is not None:
        return check_whole("workers", typed, least=0)
    text = os.environ.get(WORKERS_VARIABLE)
    if not text:
        return core_count()
    if not text.isdecimal():
        raise InvalidValueError(f"{WORKERS_VARIABLE} is {text!r}; it must be a number from 0.")
    return int(text)
