"""What a setting is asked for, and what it hands back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from roboirg.episode import COLOURS, Episode, SceneObject
from roboirg.errors import InvalidValueError
from roboirg.language.choice import Chooser
from roboirg.language.instruction import Form, Setting, UtteranceStage
from roboirg.language.landmarks import Frame
from roboirg.language.phrases import Phrase, fill
from roboirg.tasks import Task

Distractor = Literal["neutral", "competing"]
DISTRACTORS: tuple[Distractor, ...] = ("neutral", "competing")

PartKind = Literal["colour", "number"]
PART_KINDS: Mapping[str, PartKind] = {
    "colour": "colour",
    "colours": "colour",
    "repeats": "number",
}
"""What kind of value each goal slot holds."""


class Part(NamedTuple):
    """One value of the goal that an instruction has to convey.

    Attributes:
        field: its field in the task's commands, ``repeats`` or ``colours.1``.
        slot: name of the goal slot.
        kind: what kind of value it is.
        value: the value.
    """

    field: str
    slot: str
    kind: PartKind
    value: str | int

    @property
    def colour(self) -> str:
        """The value of a part that is a colour."""
        return str(self.value)

    @property
    def number(self) -> int:
        """The value of a part that is a number."""
        return int(self.value)


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be put into words, and how; see `instruct` for the options."""

    episode: Episode
    task: Task
    form: Form
    stages: tuple[int, ...]
    distractor: Distractor
    distractors: int
    frame: Frame
    chooser: Chooser

    @property
    def resolved(self) -> bool:
        """Whether the command is to name what its referring expressions stand for."""
        return self.form == "resolved"

    @property
    def parts(self) -> tuple[Part, ...]:
        """The values of the goal, in the order of its slots."""
        parts: list[Part] = []
        for slot, value in self.episode.goal.slots:
            kind = PART_KINDS[slot]
            if isinstance(value, tuple):
                several = enumerate(value)
                parts += [Part(f"{slot}.{index}", slot, kind, one) for index, one in several]
            else:
                parts.append(Part(slot, slot, kind, value))
        return tuple(parts)

    def parts_of(self, kind: PartKind) -> tuple[Part, ...]:
        """The parts of one kind."""
        return tuple(part for part in self.parts if part.kind == kind)

    def by_colour(self, cube: Phrase) -> Phrase:
        """The thing to handle, told by its cube."""
        return fill(self.task.commands.by_colour, {"cube": cube})

    def by_place(self, place: Phrase) -> Phrase:
        """The thing to handle, told by its place."""
        return fill(self.task.commands.by_place, {"place": place})

    def target(self, part: Part) -> SceneObject:
        """The object that a colour part wants handled: the cube, or the container over it."""
        scene = self.episode.scene
        cube = next(item for item in scene.objects if item.colour == part.value)
        return cube if cube.inside is None else scene[cube.inside]

    def command(self, fields: Mapping[str, Phrase]) -> Phrase:
        """The task's command with its fields filled; the same wording in all settings."""
        handled = max(1, sum(1 for part in self.parts if part.field.rpartition(".")[2].isdigit()))
        wordings = [one for one in self.task.commands.wordings if one.parts == handled]
        return fill(self.chooser.pick(f"command-{handled}", wordings).text, fields)


class Said(NamedTuple):
    """One utterance to be."""

    stage: UtteranceStage
    phrase: Phrase


@dataclass(frozen=True, slots=True)
class Draft:
    """What a setting says, in order, and what it wants noted in the metadata."""

    said: tuple[Said, ...]
    notes: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SettingRule:
    """One setting of the language.

    Attributes:
        name: as in `SETTINGS`.
        say: the words for a request.
        can_say: whether there are any.
    """

    name: Setting
    say: Callable[[Request], Draft]
    can_say: Callable[[Request], bool] = lambda _request: True


def other_colours(colour: str) -> tuple[str, ...]:
    """The two colours of the benchmark that are not this one."""
    if colour not in COLOURS:
        raise InvalidValueError(
            f"{colour!r} is not a colour; the colours are {', '.join(COLOURS)}."
        )
    return tuple(other for other in COLOURS if other != colour)
