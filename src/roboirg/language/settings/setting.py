"""The definition of a setting, from which the rest of the benchmark derives everything."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.instruction_options import OPTION_NAMES, InstructionOptions
from roboirg.language.instruction import Instruction
from roboirg.language.request import InstructionRequest, InstructionSpec
from roboirg.tasks import Task

Instruct = Callable[[InstructionOptions], Instruction]
"""Returns an instruction of the episode at hand."""
Offers = Callable[[InstructionRequest], Iterable[Any]]
"""Yields each way to the goal that a scenario can say: an `Offer` of `scenarios.introduced`."""


def never_refuses(_request: InstructionRequest) -> str | None:
    """Return None: the setting can express every episode of its tasks."""
    return None


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of the language; a file in ``settings/`` defines one as ``SETTING``.

    Attributes:
        name: in the command line, records and tables, for example ``"direct"``.
        order: position in lists and tables; explicit is 0.
        summary: one line for docs and help, without a final stop.
        color: in figures, as ``"#rrggbb"``; ours are from the palette of Okabe and Ito, which
            color-blind readers can tell apart.
        say: returns the words for a request.
        applies_to: whether a task has the setting.
        refusal: returns why the setting cannot express a request, in words that follow "cannot
            express the episode:" and name no object of the scene; None if it can.
        implicit: whether the command leaves something to its context.
        reads: names of the options that change its words, and ``delivery`` if it has several
            utterances.
        variants: every combination of options that change its words, for validation.
        pairing_rules: yields how the words of an episode differ from those of another setting
            with which they must agree; nothing if they agree.
        example: index of the test episode that shows the setting in the language card.
        plain: name of the setting that this one makes harder; None if it stands by itself. Harder
            settings are played only where they are named: ``all`` leaves them out.
        offers: the ways to the goal that scenarios of language 4 can say; or the name of a setting
            of ours that has the same ways: ``"direct"``, or ``"explicit"`` for the command alone,
            or ``"contextual"`` for the scenarios of direct with what stands between. Empty if
            `say` has the words of language 4, too.
        words: the file with its scenarios, by its whole path, such as
            ``str(Path(__file__).with_name("words.toml"))``; empty if they stand in the files of
            the tasks.

    Raises:
        UnknownNameError: it reads an option that does not exist.
        InvalidValueError: it has offers, and does not read the language.
    """

    name: str
    order: int
    summary: str
    color: str
    say: Callable[[InstructionRequest], InstructionSpec]
    applies_to: Callable[[Task], bool] = lambda _task: True
    refusal: Callable[[InstructionRequest], str | None] = never_refuses
    implicit: bool = True
    reads: frozenset[str] = frozenset()
    variants: Sequence[Mapping[str, Any]] = ({},)
    pairing_rules: Callable[[Instruct], Iterable[str]] = lambda _instruct: ()
    example: int = 0
    plain: str | None = None
    offers: Offers | str = ""
    words: str = ""

    def __post_init__(self) -> None:
        check_names("option of instructions", self.reads, OPTION_NAMES)
        if self.offers and "language" not in self.reads:
            raise InvalidValueError(
                f"The setting {self.name} has offers, so 'language' must be in its reads."
            )

    @property
    def may_refuse(self) -> bool:
        """Whether the setting cannot express some episodes of its tasks."""
        return self.refusal is not never_refuses
