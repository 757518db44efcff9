"""What a policy's process computes with: number types, devices, versions of libraries."""

from __future__ import annotations

import contextlib
import importlib.metadata
import platform
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import msgspec

Word = Annotated[str, msgspec.Meta(max_length=100)]
Words = Annotated[tuple[Word, ...], msgspec.Meta(max_length=20)]

LIBRARIES = (
    "roboirgbench",
    "numpy",
    "torch",
    "jax",
    "flax",
    "transformers",
    "diffusers",
    "lerobot",
    "openai",
    "google-genai",
)
"""Distributions whose version is reported if the process has imported them."""

_MODULES = {"google-genai": "google.genai", "roboirgbench": "roboirg"}
_DEPTH = 5
_MOST_OBJECTS = 200


class InferenceFacts(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is known of a process that infers actions.

    Attributes:
        python: version of the interpreter.
        libraries: versions, by distribution.
        dtypes: number types of the parameters of its PyTorch networks, the most frequent first.
        devices: where these parameters are, the most frequent first.
    """

    python: Word
    libraries: Annotated[dict[Word, Word], msgspec.Meta(max_length=20)] = {}
    dtypes: Words = ()
    devices: Words = ()


def inference_facts(policy: object) -> InferenceFacts:
    """Return the facts of this process and of the networks that a policy holds.

    A policy whose networks are elsewhere, as in another process, has the facts as ``inference``.
    """
    known = getattr(policy, "inference", None)
    if isinstance(known, InferenceFacts):
        return known
    dtypes: Counter[str] = Counter()
    devices: Counter[str] = Counter()
    for parameter in _parameters(policy):
        for counts, value in ((dtypes, parameter.dtype), (devices, parameter.device)):
            counts[str(value).removeprefix("torch.")[:100]] += int(parameter.numel())
    return InferenceFacts(
        python=platform.python_version(),
        libraries=_libraries(),
        dtypes=tuple(name for name, _ in dtypes.most_common(20)),
        devices=tuple(name for name, _ in devices.most_common(20)),
    )


def _libraries() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        if _MODULES.get(name, name) in sys.modules:
            with contextlib.suppress(importlib.metadata.PackageNotFoundError):
                found[name] = importlib.metadata.version(name)[:100]
    return found


def _parameters(policy: object) -> Iterator[Any]:
    """Yield the parameters of PyTorch networks among the attributes of an object, and of theirs."""
    torch = sys.modules.get("torch")
    module = getattr(getattr(torch, "nn", None), "Module", None)
    if module is None:
        return
    seen: set[int] = set()
    level: list[object] = [policy]
    for _ in range(_DEPTH):
        below: list[object] = []
        for one in level[:_MOST_OBJECTS]:
            if id(one) in seen:
                continue
            seen.add(id(one))
            if isinstance(one, module):
                yield from one.parameters()
            elif isinstance(one, Mapping):
                below += one.values()
            elif isinstance(one, list | tuple):
                below += one
            elif hasattr(one, "__dict__"):
                below += vars(one).values()
        level = below
