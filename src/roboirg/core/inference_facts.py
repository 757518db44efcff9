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

_MOST_LETTERS = 100
_MOST_WORDS = 20
Word = Annotated[str, msgspec.Meta(max_length=_MOST_LETTERS)]
Words = Annotated[tuple[Word, ...], msgspec.Meta(max_length=_MOST_WORDS)]

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
"""Modules of distributions of another name."""
_DEPTH = 5
"""How far below a policy networks are looked for: attributes, theirs, and so on."""
_MOST_OBJECTS = 200
"""That are looked at on each level."""


class InferenceFacts(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is known of a process that infers actions.

    Attributes:
        python: version of the interpreter.
        libraries: versions, by distribution.
        dtypes: number types of the parameters of its PyTorch networks, the most frequent first.
        devices: where these parameters are, the most frequent first.
    """

    python: Word
    libraries: Annotated[dict[Word, Word], msgspec.Meta(max_length=_MOST_WORDS)] = {}
    dtypes: Words = ()
    devices: Words = ()


def inference_facts(policy: object) -> InferenceFacts:
    """Return what this process computes with, and number types and devices of a policy's networks.

    ``libraries={"torch": "2.4.0"}, dtypes=("bfloat16",), devices=("cuda:0",)``. A policy whose
    networks are in another process has the facts of that as its attribute ``inference``.
    """
    known = getattr(policy, "inference", None)
    if isinstance(known, InferenceFacts):
        return known
    dtypes: Counter[str] = Counter()
    devices: Counter[str] = Counter()
    for parameter in _parameters(policy):
        size = int(parameter.numel())
        dtypes[_word(parameter.dtype)] += size
        devices[_word(parameter.device)] += size
    return InferenceFacts(
        python=platform.python_version(),
        libraries=_libraries(),
        dtypes=tuple(name for name, _ in dtypes.most_common(_MOST_WORDS)),
        devices=tuple(name for name, _ in devices.most_common(_MOST_WORDS)),
    )


def _word(value: object) -> str:
    """Return what PyTorch calls a number type or a device: ``float32`` for ``torch.float32``."""
    return str(value).removeprefix("torch.")[:_MOST_LETTERS]


def _libraries() -> dict[str, str]:
    """Return the versions of the libraries that this process has imported.

    ``{"torch": "2.4.0", "numpy": "2.1.0"}``; nothing is imported to find out.
    """
    versions = {}
    for name in LIBRARIES:
        if _MODULES.get(name, name) in sys.modules:
            with contextlib.suppress(importlib.metadata.PackageNotFoundError):
                versions[name] = importlib.metadata.version(name)[:_MOST_LETTERS]
    return versions


def _parameters(policy: object) -> Iterator[Any]:
    """Yield the parameters of PyTorch networks among the attributes of an object, and of theirs.

    Searches level by level: the object, what it holds, what these hold, and so on, `_DEPTH` levels;
    each object once, as they may hold each other. What a network holds is not searched: its
    parameters include those of its parts.
    """
    torch = sys.modules.get("torch")  # a process that has not imported it has no networks
    network_class = getattr(getattr(torch, "nn", None), "Module", None)
    if network_class is None:
        return
    seen_ids = set()
    level: list[object] = [policy]
    for _ in range(_DEPTH):
        next_level: list[object] = []
        for value in level[:_MOST_OBJECTS]:
            if id(value) in seen_ids:
                continue
            seen_ids.add(id(value))
            if isinstance(value, network_class):
                yield from value.parameters()
            elif isinstance(value, Mapping):
                next_level += value.values()
            elif isinstance(value, list | tuple):
                next_level += value
            elif hasattr(value, "__dict__"):
                next_level += vars(value).values()
        level = next_level
