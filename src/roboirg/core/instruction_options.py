"""The options that select one instruction of an episode."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, TypedDict

from roboirg.core.field_types import Label, Stages, Whole, described

ALL_STAGES = (1, 2, 3, 4, 5)
DEFAULT_DISTRACTOR = "neutral"
DEFAULT_DISTRACTORS = 1
DEFAULT_FRAME = "robot"
DEFAULT_DELIVERY = "prompt"
DEFAULT_LANGUAGE = 3


@dataclass(frozen=True, slots=True)
class InstructionOptions:
    """The options of an instruction. Equal options give the same words for the same episode.

    All but `delivery` select the words. Plans, environments, jobs, records and commands take their
    options of instructions from these fields.

    Attributes:
        wordings: ``train`` or ``test`` for the words of that pool (`roboirg.core.word_pools`); or
            the identity of the wording file whose words are said, such as
            ``robomme@1a2b3c4d``, which the process must have opened. None for our words of the
            episode's split.
        delivery: see `roboirg.core.delivery`.
    """

    setting: Label = field(default="explicit", metadata=described("Name of the setting."))
    form: Label = field(
        default="implicit",
        metadata=described(
            "implicit; or resolved, with the command's referring expressions replaced by what they "
            "mean."
        ),
    )
    stages: Stages = field(
        default=ALL_STAGES,
        metadata=described(
            "Stages of the contextual setting, such as 1,5: 1 introduction, 2 reinforcement, "
            "3 distractor, 4 cue, 5 command."
        ),
    )
    distractor: Label = field(
        default=DEFAULT_DISTRACTOR,
        metadata=described("Distractors of the contextual setting: neutral or competing."),
    )
    distractors: Whole = field(
        default=DEFAULT_DISTRACTORS,
        metadata=described("Number of distractors in the contextual setting."),
    )
    frame: Label = field(
        default=DEFAULT_FRAME,
        metadata=described("Whose left and right the spatial setting uses: robot or camera."),
    )
    wordings: Label | None = field(
        default=None,
        metadata=described(
            "Wording file with words of your own; or train or test: our words of that pool in "
            "every split."
        ),
    )
    delivery: Label = field(
        default=DEFAULT_DELIVERY,
        metadata=described(
            "prompt: the whole instruction at once; turns: one utterance after another."
        ),
    )
    language: Whole = field(
        default=DEFAULT_LANGUAGE,
        metadata=described(
            "Version of our words: 3; or 4, whole scenarios, for tasks that have them."
        ),
    )


def identifying(options: InstructionOptions) -> dict[str, Any]:
    """Return the fields of options that names and fingerprints hash: the usual language is none.

    Those from before there was another language do not have it.
    """
    usual = ("language", DEFAULT_LANGUAGE)
    return {name: value for name, value in asdict(options).items() if (name, value) != usual}


class WordKeywords(TypedDict, total=False):
    """The fields of `InstructionOptions` but setting and form, as keyword arguments."""

    stages: Sequence[int]
    distractor: str
    distractors: int
    frame: str
    wordings: str | Path | None
    delivery: str
    language: int


class InstructionKeywords(WordKeywords, total=False):
    """The fields of `InstructionOptions` as keyword arguments."""

    setting: str
    form: str


OPTION_NAMES = tuple(one.name for one in fields(InstructionOptions))
"""The names of all options."""


def as_fields(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return keyword arguments of options as fields, whose stages are a tuple."""
    stages = given.get("stages", ())
    several = tuple(stages) if isinstance(stages, Iterable) else (stages,)
    return {**given, "stages": several} if "stages" in given else dict(given)
