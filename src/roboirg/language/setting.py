"""What a setting is: everything that the rest of the benchmark derives from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from roboirg.core.episode import Goal
from roboirg.language.instruction import Instruction
from roboirg.language.request import InstructionRequest, InstructionSpec
from roboirg.tasks import Task

OptionName = Literal["stages", "distractor", "distractors", "frame"]
"""An option of `roboirg.language.instruct` that a setting may read."""


def never_refuses(_request: InstructionRequest) -> str | None:
    """Return None: every episode of the tasks can be told."""
    return None


def all_slots(_instruction: Instruction, goal: Goal) -> frozenset[str]:
    """Return every slot of the goal."""
    return frozenset(goal.as_mapping())


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of the language; a file in ``settings/`` defines one as ``SETTING``.

    Attributes:
        name: in the command line, records and tables, for example ``"direct"``.
        order: position in lists and tables; explicit is 0.
        summary: one line for docs and help, without a final stop.
        color: in figures, as ``"#rrggbb"``.
        say: the words for a request.
        applies_to: whether the setting is defined for a task.
        refusal: why a request cannot be told in words that follow "cannot express the episode:",
            or None if it can.
        hidden_slots: the goal slots that the command of an implicit form must not state.
        implicit: whether the command leaves something to its context.
        reads: the options of `instruct` that change its words.
        variants: every combination of those options that validation goes through.
        hides_only_color: whether its commands state numbers and hide colors, so that a scene
            with a single fitting goal gives it away.
        example: number of the test episode that shows it in the language card.
    """

    name: str
    order: int
    summary: str
    color: str
    say: Callable[[InstructionRequest], InstructionSpec]
    applies_to: Callable[[Task], bool] = lambda _task: True
    refusal: Callable[[InstructionRequest], str | None] = never_refuses
    hidden_slots: Callable[[Instruction, Goal], frozenset[str]] = all_slots
    implicit: bool = True
    reads: frozenset[OptionName] = frozenset()
    variants: Sequence[Mapping[str, Any]] = ({},)
    hides_only_color: Callable[[Instruction], bool] = lambda _instruction: False
    example: int = 0
