"""What a reasoning pattern is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.language.phrases import Phrase
from roboirg.language.request import InstructionRequest
from roboirg.language.slot_types import Fields

REFERENCE = "reference"
"""Slot of the mentions that stand for what the goal is derived from, not for the goal."""


class Derived(NamedTuple):
    """A goal told by something else.

    Attributes:
        context: the introduction.
        fields: the fields of the command that are derived from it.
        notes: for the metadata.
    """

    context: Phrase
    fields: Fields
    notes: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class Pattern:
    """One way to derive a goal.

    Attributes:
        allows: whether an episode can be told this way.
        derive: how it is told.
    """

    allows: Callable[[InstructionRequest], bool]
    derive: Callable[[InstructionRequest], Derived]
