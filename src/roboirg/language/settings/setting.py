"""The definition of a setting, from which the rest of the benchmark derives everything."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from roboirg.core.errors import check_names
from roboirg.core.instruction_options import OPTION_NAMES
from roboirg.language.request import InstructionRequest
from roboirg.tasks import Task

ContentPlanner = Callable[[InstructionRequest], Iterable[Any]]
"""Yields each content plan for an episode: a `ContentPlan` of `scenarios.fillers`."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of the language; a file in ``settings/`` defines one as ``SETTING``.

    Attributes:
        name: in the command line, records and tables, for example ``"direct"``.
        order: position in lists and tables; explicit is 0.
        summary: one line for docs and help, without a final stop.
        color: in figures, as ``"#rrggbb"``; ours are from the palette of Okabe and Ito, which
            color-blind readers can tell apart.
        content_plans: yields the content plans of an episode, the ways to say its goal without
            naming it in the command (which fields of the command are pronouns, and what the
            introduction names for them); or the name of a setting of ours with the same plans:
            ``"direct"``, or ``"explicit"`` for the command alone, or ``"contextual"`` for the
            scenarios of direct with what stands between.
        applies_to: whether a task has the setting.
        refusal: returns why the setting cannot express a request, in words that follow "cannot
            express the episode:" and name no object of the scene; None if it can.
        implicit: whether the command leaves something to its context.
        reads: names of the options that change its words, and ``delivery`` if it has several
            utterances.
        variants: every combination of options that change its words.
        example: index of the test episode that shows the setting in the language card.
        plain: name of the setting that this one makes harder; None if it stands by itself. Harder
            settings are played only where they are named: ``all`` leaves them out.
        words: the file with its scenarios, by its whole path, such as
            ``str(Path(__file__).with_name("words.toml"))``; empty if they stand in the files of
            the tasks.

    Raises:
        UnknownNameError: it reads an option that does not exist.
    """

    name: str
    order: int
    summary: str
    color: str
    content_plans: ContentPlanner | str
    applies_to: Callable[[Task], bool] = lambda _task: True
    refusal: Callable[[InstructionRequest], str | None] = lambda _request: None
    implicit: bool = True
    reads: frozenset[str] = frozenset()
    variants: Sequence[Mapping[str, Any]] = ({},)
    example: int = 0
    plain: str | None = None
    words: str = ""

    def __post_init__(self) -> None:
        check_names("option of instructions", self.reads, OPTION_NAMES)
