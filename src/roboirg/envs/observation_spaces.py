"""The observation space, with a text that survives Gymnasium's shared memory."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import shared_memory

from roboirg.core.actions import JOINT_HIGH, JOINT_LOW
from roboirg.simulation.observation_builder import (
    FieldFormat,
    ObservationSpec,
    picture_fields,
    proprioception_fields,
)

MAX_INSTRUCTION_LENGTH = 100_000
PRINTABLE = "".join(chr(code) for code in range(ord(" "), ord("~") + 1))
_SLACK = 0.1
"""Radians by which joints may exceed their limits under load."""
_GRIPPER_LOW = -0.01
_GRIPPER_HIGH = 0.05
"""Meters: a finger moves from 0 to 0.04, and a little beyond under load."""


class InstructionSpace(spaces.Text):
    """Printable ASCII text of up to `MAX_INSTRUCTION_LENGTH` characters.

    `gymnasium.vector.AsyncVectorEnv` reads its shared memory only once: arrays are views of it, but
    of any `Text` only blanks are ever returned. The functions below make a view of texts.
    """

    def __init__(self) -> None:
        super().__init__(MAX_INSTRUCTION_LENGTH, charset=PRINTABLE)


class _TextView(Sequence[str]):
    """The texts in a block of shared memory, one for each environment.

    It reads the memory at each access; a copy is a tuple of the texts as they are then.

    Attributes:
        rows: (environments, MAX_INSTRUCTION_LENGTH) uint8, each a text with zeros after it.
    """

    def __init__(self, block: Any) -> None:  # noqa: ANN401 - a synchronized array of ctypes
        bytes_of_all = np.frombuffer(block.get_obj(), np.uint8)
        self.rows = bytes_of_all.reshape(-1, MAX_INSTRUCTION_LENGTH)

    def __getitem__(self, index: Any) -> Any:  # noqa: ANN401 - as the Sequence protocol has it
        if isinstance(index, slice):
            return tuple(self)[index]
        return self.rows[index].tobytes().rstrip(b"\0").decode("ascii")

    def __len__(self) -> int:
        return len(self.rows)

    def __deepcopy__(self, memo: object) -> tuple[str, ...]:
        return tuple(self)


@shared_memory.create_shared_memory.register(InstructionSpace)
def _create(space: InstructionSpace, n: int = 1, ctx: Any = None) -> Any:  # noqa: ANN401, ARG001
    """Return shared memory for the texts of `n` environments; `_TextView` reads it."""
    return ctx.Array(ctypes.c_uint8, n * MAX_INSTRUCTION_LENGTH)


@shared_memory.write_to_shared_memory.register(InstructionSpace)
def _write(space: InstructionSpace, index: int, values: str, block: Any) -> None:  # noqa: ANN401, ARG001
    """Write the text of an environment into its row, with zeros up to the end of the row."""
    text = values.encode("ascii")
    row = _TextView(block).rows[index]
    row[: len(text)] = np.frombuffer(text, np.uint8)
    row[len(text) :] = 0


@shared_memory.read_from_shared_memory.register(InstructionSpace)
def _read(space: InstructionSpace, block: Any, n: int = 1) -> _TextView:  # noqa: ANN401, ARG001
    """Return a view of the texts of all environments."""
    return _TextView(block)


def make_observation_space(spec: ObservationSpec) -> spaces.Dict:
    """Return the space of observations with these fields, and of their history if they have one."""
    instruction = InstructionSpace()
    fields: dict[str, spaces.Space[Any]] = {**_spaces(spec), "instruction": instruction}
    if spec.observe_every is not None:
        entry = spaces.Dict({**_spaces(spec.for_history), "instruction": instruction})
        fields["history"] = spaces.Sequence(entry)
    return spaces.Dict(fields)


def _spaces(spec: ObservationSpec) -> dict[str, spaces.Space[Any]]:
    """Return the space of each field of `ObservationBuilder.read`."""
    formats = picture_fields(spec) | proprioception_fields(spec)
    return {name: _space(name, format_) for name, format_ in formats.items()}


def _space(name: str, format_: FieldFormat) -> spaces.Box:
    """Return the space of a field of observations, such as ``joint_positions``.

    Joints and gripper have known bounds. A field of whole numbers has those of its type, such as 0
    to 255, and any other field none.
    """
    if name == "joint_positions":
        low = (JOINT_LOW - _SLACK).astype(np.float32)
        high = (JOINT_HIGH + _SLACK).astype(np.float32)
        return spaces.Box(low, high)
    if name == "gripper":
        return spaces.Box(_GRIPPER_LOW, _GRIPPER_HIGH, format_.shape, np.float32)
    if issubclass(format_.dtype, np.integer):
        limits = np.iinfo(format_.dtype)
        return spaces.Box(int(limits.min), int(limits.max), format_.shape, format_.dtype)
    dtype = cast("type[np.floating[Any]]", format_.dtype)
    return spaces.Box(-np.inf, np.inf, format_.shape, dtype)
