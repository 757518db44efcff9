"""The options that select one instruction of an episode."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, TypedDict

from roboirg.core.field_types import Label, Stages, Whole, described
from roboirg.core.plain_text import counted

ALL_STAGES = (1, 2, 3, 4, 5)
DEFAULT_DISTRACTOR = "neutral"
DEFAULT_DISTRACTORS = 1
DEFAULT_FRAME = "robot"
DEFAULT_DELIVERY = "prompt"


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


class WordKeywords(TypedDict, total=False):
    """The fields of `InstructionOptions` but setting and form, as keyword arguments."""

    stages: Sequence[int]
    distractor: str
    distractors: int
    frame: str
    wordings: str | Path | None
    delivery: str


class InstructionKeywords(WordKeywords, total=False):
    """The fields of `InstructionOptions` as keyword arguments."""

    setting: str
    form: str


OPTION_NAMES = tuple(option.name for option in fields(InstructionOptions))
"""The names of all options."""


def as_fields(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return keyword arguments of options as fields, whose stages are a tuple.

    ``{"stages": [1, 5]}`` -> ``{"stages": (1, 5)}``, and ``{"stages": 5}`` -> ``{"stages": (5,)}``.
    Others stay; the mapping that is given does not change.
    """
    values = dict(given)
    if "stages" in values:
        stages = values["stages"]
        values["stages"] = tuple(stages) if isinstance(stages, Iterable) else (stages,)
    return values


_DEFAULTS = InstructionOptions()
_PHRASES: dict[str, Callable[[Any], str]] = {
    "form": str,
    "stages": lambda stages: "stages " + ",".join(map(str, stages)),
    "distractor": "{} distractor".format,
    "distractors": lambda count: counted(count, "distractor"),
    "frame": "{} frame".format,
    "delivery": "in {}".format,
}
"""How labels name the value of an option; of any other option, by its name."""


def options_label(options: InstructionOptions) -> str:
    """Return how instruction options are printed: ``relational (resolved, 2 distractors)``.

    In brackets behind the setting are the options that differ from their defaults.
    """
    phrases = []
    for name, value in asdict(options).items():
        is_default = value == getattr(_DEFAULTS, name)
        if is_default or name in ("setting", "wordings"):
            continue
        phrase_of = _PHRASES.get(name, f"{name} {{}}".format)
        phrases.append(phrase_of(value))

    if not phrases:
        return options.setting
    return f"{options.setting} ({', '.join(phrases)})"
