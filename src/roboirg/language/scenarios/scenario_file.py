"""Read the data files of language 4; complaints name file, scenario and field."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Collection, Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any, NoReturn, TypeVar

import msgspec

from roboirg.core.errors import InvalidValueError
from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.core.word_pools import PoolName
from roboirg.language.scenarios.markup import Pointer, Text, parse, pointers_in, slots_in
from roboirg.language.scenarios.scenario import (
    PEOPLE,
    REMARKS,
    General,
    PointerRow,
    Scenario,
    ScenarioFields,
    TaskFields,
    TaskScenarios,
    Texts,
)

FOLDER = files("roboirg.language.scenarios")
Stored = TypeVar("Stored")
PRONOUNS = {"he": ("he", "him", "his"), "she": ("she", "her", "her")}
GIVEN = frozenset(
    {"list", "list.0", "list.1", "list.2", "rank", "reference", "step", "excluded", "taken"}
    | {"place", "place.0", "place.1", "clue", "clue.0", "clue.1", "aside.0", "aside.1", "rest"}
    | {"total"}
    | PEOPLE
)
"""Slots that are no fields of the goal."""
_CONTEXTUAL = ("reinforcement", "distractors", "competing", "cue")
SENTENCES = frozenset({"introduction", *_CONTEXTUAL, "lead", "say", "resolved", "remarks"})
"""The fields that hold sentences."""


@functools.cache
def pointer_table() -> tuple[PointerRow, ...]:
    """Return the closed table of pointers."""
    return _shared(dict[str, tuple[PointerRow, ...]], "pointers.toml")["pointer"]


@functools.cache
def general() -> General:
    """Return what all tasks share."""
    return _shared(General, "general.toml")


def _shared(kind: type[Stored], name: str) -> Stored:
    return _as(kind, FOLDER.joinpath(name).read_text(encoding="utf-8"), name)


@functools.cache
def task_scenarios(task: str) -> TaskScenarios | None:
    """Return the words of a task; None if none have been written."""
    path = FOLDER.joinpath(f"{task}.toml")
    return read_scenario_file(path) if path.is_file() else None


def read_task_scenarios(text: str, where: str) -> TaskScenarios:
    """Return the content of a file; `where` names it in complaints.

    A file of scenarios alone takes the commands of the task's own file.

    Raises:
        InvalidValueError: it is not as `docs/add-scenario.md` says.
    """
    head = _as(TaskFields, text, where)
    own = None if head.commands else task_scenarios(head.task)
    if own is None and not head.commands:
        _fail(where, f"has no commands, and there is no {head.task}.toml to take them from")
    stated = own.stated if own else {
        name: _parsed(one, f"{where}, stated") for name, one in head.stated.items()
    }  # fmt: skip
    scenarios = tuple(
        _scenario(one, stated, f"{where}, scenario {one.get('frame', number)!r}")
        for number, one in enumerate(head.scenario, 1)
    )
    names = [(one.fields.frame, one.fields.setting, one.fields.pool) for one in scenarios]
    for name in names:
        if names.count(name) > 1:
            _fail(where, f"has the frame {name[0]!r} twice in the setting {name[1]}, {name[2]}")
    commands = own.commands if own else _commands(head, where)
    return TaskScenarios(head.task, commands, stated, scenarios)


def _commands(head: TaskFields, where: str) -> dict[tuple[PoolName, frozenset[str]], Texts]:
    found: dict[tuple[PoolName, frozenset[str]], Texts] = {}
    for pool, texts in head.commands.items():
        for command in texts:
            of = (pool, frozenset(slots_in(_parsed(command, f"{where}, commands"))))
            found[of] = (*found.get(of, ()), command)
    return found


def _scenario(written: Mapping[str, Any], stated: Collection[str], where: str) -> Scenario:
    others = {name: value for name, value in written.items() if name not in SENTENCES}
    fields = _as(ScenarioFields, others, where)
    texts: dict[str, tuple[Text, ...]] = {}
    for name, value in _flat({name: written[name] for name in written if name in SENTENCES}):
        at = f"{where}, {name}"
        several = _as(Texts, [value] if isinstance(value, str) else value, at)
        texts[name] = tuple(_sentence(one, fields.list, stated, at) for one in several)
    said = tuple(name.removeprefix("say.") for name in texts if name.startswith("say."))
    _check_fields(fields, texts, said, stated, where)
    classes: dict[str, tuple[Text, ...]] = {}
    for one in texts[f"say.{said[0]}"]:
        kind = next((pointer.expression for pointer in pointers_in(one)), "")
        classes[kind] = (*classes.get(kind, ()), one)
    return Scenario(fields, texts, _people(fields, texts), said, classes)


def _people(
    fields: ScenarioFields, texts: Mapping[str, tuple[Text, ...]]
) -> tuple[tuple[str, ...], ...]:
    """Return who can be spoken of, each with his or her pronouns, if the sentences speak of any."""
    said = (name for several in texts.values() for text in several for name in slots_in(text))
    if PEOPLE.isdisjoint(said):
        return ()
    people = fields.people or general().people
    return tuple((name, *PRONOUNS[one]) for one, names in people.items() for name in names)


def _check_fields(
    fields: ScenarioFields,
    texts: Mapping[str, tuple[Text, ...]],
    said: Texts,
    stated: Collection[str],
    where: str,
) -> None:
    """Check what a setting needs."""
    needed = ["introduction", *(_CONTEXTUAL if fields.setting == "direct" else ())]
    if fields.setting == "direct-rival":
        needed += [f"remarks.{name}" for name in REMARKS]
    lacking = [name for name in needed if not any(texts.get(name, ()))]
    unknown = sorted(set(said) - set(stated))
    wrong = {
        "has no say; give words for the fields that the command leaves open": not said,
        f"has say.{', say.'.join(unknown)}; the fields are {', '.join(stated)}": unknown,
        f"has no {' and no '.join(lacking)}; {fields.setting} needs {', '.join(needed)}": lacking,
        "must have derive if its setting is reasoning, and only then": (
            (fields.derive is not None) != (fields.setting == "reasoning")
        ),
        "has a competing remark that names no {rival …}": not all(
            any(name.startswith("rival ") for name in slots_in(one))
            for one in texts.get("competing", ())
        ),
        "has a single person; another one must be possible": fields.people is not None
        and len(list(itertools.chain(*fields.people.values()))) == 1,
        f"has a list of {fields.list!r}; the slots are {', '.join(sorted(_slots(stated)))}": (
            fields.list and fields.list not in _slots(stated)
        ),
    }
    for complaint, holds in wrong.items():
        if holds:
            _fail(where, complaint)


def _slots(stated: Collection[str]) -> set[str]:
    """Return the slots of a task, and its fields: ``colors`` and ``colors.0``."""
    return {*stated, *(name.partition(".")[0] for name in stated)}


def _sentence(text: str, listed: str, stated: Collection[str], where: str) -> Text:
    """Return a sentence, with the rows of the closed table for what points back."""
    parts = _parsed(text, where)
    known = GIVEN | _slots(stated)
    for name in slots_in(parts):
        if name.removeprefix("rival ") not in known:
            _fail(where, f"has the slot {name!r}; known: {', '.join(sorted(known))}")
    # As the table has it: without class and slot, and with any noun for a step.
    said = re.sub(r"\{step:[^}]+\}", "{step:*}", re.sub(r"<[^:<>]+: ", "<", text))
    return tuple(
        _pointing(one, said, type_of(one.of, listed), where) if isinstance(one, Pointer) else one
        for one in parts
    )


def _pointing(pointer: Pointer, said: str, kind: str, where: str) -> Pointer:
    """Return a pointer with what its row says."""
    words = pointer.words
    of_kind = [row for row in pointer_table() if kind in row.of]
    # First those that are said with the words around them.
    rows = [one for one in of_kind if f"<{words}>" in one.words and one.words in said]
    rows += [one for one in of_kind if words == one.words]
    row = next((one for one in rows if one.kind == pointer.expression), None)
    if row is None:
        _fail(
            where,
            f"has the pointer <{pointer.expression} {pointer.of}: {words}>, which is not in "
            f"pointers.toml; for a {kind} there are: "
            f"{'; '.join(one.words for one in of_kind) or 'none'}",
        )
    return pointer._replace(resolved=parse(row.resolved), operation=row.operation)


def type_of(name: str, listed: str = "") -> str:
    """Return the type of what a slot stands for, as in ``of`` of the table of pointers."""
    base, _, number = name.partition(".")
    several = {"list": "pair", "colors": "colors"}
    if base in several and not number:
        return several[base]
    base = (listed or "color") if base in ("list", "taken") else base
    return SLOT_TYPE_NAMES.get(base, base)


def _flat(table: object, prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the entries of a table whose keys may hold dots: ``colors.0`` is one."""
    if not isinstance(table, dict):
        yield prefix, table
        return
    for name, value in table.items():
        yield from _flat(value, f"{prefix}.{name}" if prefix else name)


def _parsed(text: str, where: str) -> Text:
    try:
        return parse(text)
    except ValueError as error:
        raise InvalidValueError(f"{where} {error}.") from error


def _as(kind: type[Stored], data: object, where: str) -> Stored:
    """Return data of a type, from TOML if it is text."""
    try:
        if isinstance(data, str):
            return msgspec.toml.decode(data, type=kind)
        return msgspec.convert(data, kind)
    except (ValueError, msgspec.MsgspecError) as error:
        raise InvalidValueError(f"{where}: {error}.") from error


def _fail(where: str, complaint: str) -> NoReturn:
    raise InvalidValueError(f"{where} {complaint}.")


def read_scenario_file(path: Traversable) -> TaskScenarios:
    """Read a file of scenarios from anywhere."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise InvalidValueError(f"The file {str(path)!r} cannot be read: {error}.") from error
    return read_task_scenarios(text, path.name)
