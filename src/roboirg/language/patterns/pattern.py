"""The definition of a reasoning pattern."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from roboirg.language.phrases import Phrase
from roboirg.language.request import InstructionRequest
from roboirg.language.slot_types import Fields


class Derived(NamedTuple):
    """Words from which the goal follows.

    Attributes:
        context: the introduction.
        fields: the fields of the command that point at the introduction.
        notes: entries of the metadata.
    """

    context: Phrase
    fields: Fields
    notes: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class Pattern:
    """One rule that derives a goal.

    Attributes:
        allows: whether the rule works for an episode.
        derive: applies the rule.
    """

    allows: Callable[[InstructionRequest], bool]
    derive: Callable[[InstructionRequest], Derived]
