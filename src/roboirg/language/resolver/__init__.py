"""The independent reader: from words and a scene to all the goals that fit.

It shares nothing with the rooms that make the words: no template, constant or metadata. It knows
English as far as the benchmark needs it, the objects on the table, and which goals a task can
have at all.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeVar

from roboirg.episode import Goal, Scene, SceneObject
from roboirg.language.resolver.command import Command, Count, Description, is_command, read_command
from roboirg.language.resolver.context import Context, listen
from roboirg.language.resolver.places import Place, find
from roboirg.language.resolver.tokens import Sentence, split_sentences
from roboirg.tasks import get_task

__all__ = ["Resolution", "resolve"]

Told = TypeVar("Told")

_QUANTITIES = range(1, 11)
"""What a quantity that was not heard may have been."""


class Resolution(NamedTuple):
    """The outcome of reading.

    Attributes:
        goals: every goal that fits the text; one if the text says all, none if it contradicts
            the scene.
        not_understood: what was pointed at without having been introduced, and the like.
    """

    goals: tuple[Goal, ...]
    not_understood: tuple[str, ...]


def resolve(text: str, scene: Scene, task: str) -> Resolution:
    """All goals of a task that fit what is said; any text will do, whole prompts or their ends.

    Args:
        text: the prompt.
        scene: what the robot may know: objects, colours, positions, and from the video which
            cube is under which container.
        task: name of the task.

    Raises:
        UnknownNameError: there is no such task.
    """
    sentences = split_sentences(text)
    first, last = _command_span(sentences)
    before = sentences[:first]
    order: Sentence = tuple(word for part in sentences[first:last] for word in (*part, ","))
    complaints: list[str] = []
    if first == last:
        complaints.append("no command")
    reader = _Reader(scene, listen(before), complaints)
    command = read_command(order)
    wanted = [reader.objects(thing) for thing in command.things]
    counts = reader.counts(command.times)
    goals = tuple(
        goal for goal in get_task(task).goals(scene) if _fits(goal, command, wanted, counts)
    )
    return Resolution(goals, tuple(complaints))


def _command_span(sentences: tuple[Sentence, ...]) -> tuple[int, int]:
    """Where the last run of commanding sentences begins and ends."""
    last = len(sentences)
    while last and not is_command(sentences[last - 1]):
        last -= 1
    first = last
    while first and is_command(sentences[first - 1]):
        first -= 1
    return (first, last) if last else (len(sentences), len(sentences))


def _fits(
    goal: Goal, command: Command, wanted: list[set[str] | None], counts: set[int] | None
) -> bool:
    colours, numbers = _values(goal)
    if command.things and len(command.things) != len(colours):
        return False
    if counts is not None and any(number not in counts for number in numbers):
        return False
    pairs = zip(colours, wanted, strict=False)
    return all(options is None or colour in options for colour, options in pairs)


def _values(goal: Goal) -> tuple[list[str], list[int]]:
    colours: list[str] = []
    numbers: list[int] = []
    for _, value in goal.slots:
        if isinstance(value, int):
            numbers.append(value)
        else:
            colours += (value,) if isinstance(value, str) else value
    return colours, numbers


class _Reader:
    """Evaluates the command's descriptions on the scene and the context."""

    def __init__(self, scene: Scene, context: Context, complaints: list[str]) -> None:
        self._scene = scene
        self._context = context
        self._complaints = complaints
        self._kind = "container" if scene.of_kind("container") else "cube"

    def objects(self, thing: Description) -> set[str] | None:
        """The colours that a description leaves open; None if it says nothing."""
        if thing.kind == "any":
            return None
        if thing.kind == "colour":
            return set(thing.colours)
        if thing.kind == "place" and thing.place is not None:
            return self._at(thing.place)
        if thing.kind == "introduced place":
            return self._introduced_place(thing.position)
        if thing.kind == "introduced":
            return self._introduced(thing.position)
        return self._derived(thing)

    def _derived(self, thing: Description) -> set[str] | None:
        named = set(thing.colours or self._context.colours)
        if thing.kind == "not":
            if not named:
                self._complain("excluded colours")
                return None
            return {str(cube.colour) for cube in self._cubes()} - named
        minus = thing.minus or self._context.singled
        if not named or minus is None:
            self._complain("the one that is not meant")
        return (named or {str(cube.colour) for cube in self._cubes()}) - {minus}

    def _introduced(self, position: int | None) -> set[str] | None:
        if self._context.places and not self._context.colours:
            return self._introduced_place(position)
        chosen = _chosen(self._context.colours, position)
        if not chosen:
            self._complain("a colour")
            return None
        return set(chosen)

    def _introduced_place(self, position: int | None) -> set[str] | None:
        chosen = _chosen(self._context.places, position)
        if not chosen:
            self._complain("a place")
            return None
        return set().union(*(self._at(place) for place in chosen))

    def _at(self, place: Place) -> set[str]:
        found = find(place, self._scene, self._kind, mirrored=self._context.mirrored)
        cubes = [item if item.colour else self._scene.hidden_in(item.name) for item in found]
        if None in cubes or not cubes:
            self._complaints.append(f"nothing to handle at {place}")
        return {str(cube.colour) for cube in cubes if cube is not None}

    def _cubes(self) -> Iterator[SceneObject]:
        return (item for item in self._scene.objects if item.colour is not None)

    def counts(self, count: Count | None) -> set[int] | None:
        """The numbers that the command leaves open; None if it says nothing."""
        if count is None:
            return None
        told = (count.quantity,) if count.quantity is not None else self._context.numbers
        if not told:
            self._complain("a number")
            if (count.factor, count.offset) == (1.0, 0):
                return None
        quantities = told or _QUANTITIES
        results = [count.factor * quantity + count.offset for quantity in quantities]
        return {int(result) for result in results if result.is_integer()}

    def _complain(self, what: str) -> None:
        self._complaints.append(f"{what}: nothing before the command introduces it")


def _chosen(introduced: tuple[Told, ...], position: int | None) -> tuple[Told, ...]:
    """The introduced one at a position, or all of them."""
    if position is None:
        return introduced
    return introduced[position:][:1]
