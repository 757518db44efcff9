"""Read the data files of language 4; complaints name file, scenario and field."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import msgspec

from roboirg.core.errors import InvalidValueError
from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.core.word_pools import PoolName
from roboirg.language.patterns import PATTERNS
from roboirg.language.scenarios.markup import (
    Agreement,
    Part,
    Pointer,
    Slot,
    Text,
    parse,
    pointers_in,
    slots_in,
)
from roboirg.language.scenarios.scenario import (
    REMARKS,
    General,
    PointerRow,
    Scenario,
    ScenarioFields,
    TaskFields,
    TaskScenarios,
)

FOLDER = files("roboirg.language.scenarios")
Stored = TypeVar("Stored")
PERSON = ("person", "he", "him", "his")
PRONOUNS = {"he": ("he", "him", "his"), "she": ("she", "her", "her")}
GIVEN = frozenset(
    {"list", "list.0", "list.1", "list.2", "rank", "reference", "step", "excluded", "taken"}
    | {"place", "place.0", "place.1", "clue", "clue.0", "clue.1", "total"}
    | {f"{word}{number}" for word in PERSON for number in ("", ".2")}
)
"""Slots that are no fields of the goal."""
_CONTEXT = ("introduction", "reinforcement", "cue")
_CONTEXTUAL = ("reinforcement", "distractors", "competing", "cue")


@functools.cache
def pointer_table() -> tuple[PointerRow, ...]:
    """Return the closed table of pointers."""
    data = _toml(FOLDER.joinpath("pointers.toml").read_text(encoding="utf-8"), "pointers.toml")
    return _as(tuple[PointerRow, ...], data["pointer"], "pointers.toml")


@functools.cache
def general() -> General:
    """Return what all tasks share."""
    data = _toml(FOLDER.joinpath("general.toml").read_text(encoding="utf-8"), "general.toml")
    return _as(General, data, "general.toml")


@functools.cache
def task_scenarios(task: str) -> TaskScenarios | None:
    """Return the words of a task; None if none have been written."""
    path = FOLDER.joinpath(f"{task}.toml")
    if not path.is_file():
        return None
    return read_task_scenarios(path.read_text(encoding="utf-8"), f"{task}.toml")


def read_task_scenarios(text: str, where: str) -> TaskScenarios:
    """Return the content of a file; `where` names it in complaints.

    Raises:
        InvalidValueError: it is not as `docs/add-scenario.md` says.
    """
    data = _toml(text, where)
    head = _head(data, where)
    commands: dict[tuple[PoolName, frozenset[str]], tuple[Text, ...]] = {}
    for pool, texts in head.commands.items():
        for command in (_parsed(one, f"{where}, commands") for one in texts):
            of = (pool, frozenset(slots_in(command)))
            commands[of] = (*commands.get(of, ()), command)
    stated = {name: _parsed(one, f"{where}, stated") for name, one in head.stated.items()}
    scenarios = tuple(
        _scenario(one, head, f"{where}, scenario {one.get('frame', number)!r}")
        for number, one in enumerate(data.get("scenario", ()), 1)
    )
    names = [(one.fields.pool, one.name) for one in scenarios]
    for name in names:
        if names.count(name) > 1:
            _fail(where, f"has the frame {name[1]!r} twice in the pool {name[0]}")
    return TaskScenarios(head.task, commands, stated, scenarios)


def _head(data: dict[str, Any], where: str) -> TaskFields:
    """Return a file's head; a file of scenarios alone has that of the task's own file."""
    head = _as(TaskFields, data, where)
    path = FOLDER.joinpath(f"{head.task}.toml")
    if head.commands:
        return head
    if not path.is_file():
        _fail(where, f"has no commands, and there is no {path.name} to take them from")
    own = _toml(path.read_text(encoding="utf-8"), path.name)
    return _as(TaskFields, own, path.name)


def _scenario(written: Mapping[str, Any], head: TaskFields, where: str) -> Scenario:
    data = {**written}
    for field in ("say", "remarks", "resolved"):
        flat = dict(_flat(data.get(field, {})))
        data[field] = flat if field == "resolved" else {
            name: [one] if isinstance(one, str) else one for name, one in flat.items()
        }  # fmt: skip
    fields = _as(ScenarioFields, data, where)
    texts: dict[str, tuple[Text, ...]] = {name: (fields_text,) for name in (*_CONTEXT, "lead")
             if (fields_text := _parsed(getattr(fields, name), f"{where}, {name}"))}  # fmt: skip
    several = {"distractors": fields.distractors, "competing": fields.competing}
    several |= {f"say.{name}": one for name, one in fields.say.items()}
    several |= {f"remarks.{name}": one for name, one in fields.remarks.items()}
    several |= {f"resolved.{name}": (one,) for name, one in fields.resolved.items()}
    texts |= {name: tuple(_parsed(one, f"{where}, {name}") for one in found)
              for name, found in several.items()}  # fmt: skip
    for name, found in texts.items():
        for one in found:
            _check_slots(one, head, f"{where}, {name}")
            if not name.startswith("resolved"):
                _check_pointers(one, fields, f"{where}, {name}")
    _check_fields(fields, head, where)
    classes: dict[str, tuple[Text, ...]] = {}
    for one in texts[f"say.{next(iter(fields.say))}"]:
        kind = next((pointer.expression for pointer in pointers_in(one)), "")
        classes[kind] = (*classes.get(kind, ()), one)
    return Scenario(fields, texts, _people(fields, texts), tuple(fields.say), classes)


def _people(
    fields: ScenarioFields, texts: Mapping[str, tuple[Text, ...]]
) -> tuple[tuple[str, ...], ...]:
    """Return who can be spoken of, each with his or her pronouns, if the sentences speak of any."""
    used = {name for several in texts.values() for text in several for name in slots_in(text)}
    if used.isdisjoint(PERSON):
        return ()
    people = fields.people or general().people
    return tuple(
        (name, *PRONOUNS[gender]) for gender in PRONOUNS for name in getattr(people, gender)
    )


def _check_fields(fields: ScenarioFields, head: TaskFields, where: str) -> None:
    """Check what a setting needs beyond its introduction and the words that point back."""
    derive, rules = fields.derive, list(PATTERNS)
    stated = {*head.stated, *(name.partition(".")[0] for name in head.stated)}
    unknown = sorted(set(fields.say) - set(head.stated))
    lacking = [name for name in _CONTEXTUAL if not getattr(fields, name)]
    wrong = {
        "has no say; give words for the fields that the command leaves open": not fields.say,
        f"has say.{', say.'.join(unknown)}; the fields are {', '.join(head.stated)}": unknown,
        f"has no {' and no '.join(lacking)}, which contextual needs": (
            fields.setting == "direct" and lacking
        ),
        f"has the remarks {sorted(fields.remarks)}; it needs {', '.join(REMARKS)}": (
            fields.setting == "direct-rival" and set(fields.remarks) != set(REMARKS)
        ),
        "must have derive if its setting is reasoning, and only then": (
            (derive is not None) != (fields.setting == "reasoning")
        ),
        f"has derive = {derive}; its pattern is one of {', '.join(rules)}": (
            derive is not None and derive.pattern not in rules
        ),
        f"has a list of {fields.list!r}; the slots are {', '.join(sorted(stated))}": (
            fields.list and fields.list not in stated
        ),
    }
    for complaint, holds in wrong.items():
        if holds:
            _fail(where, complaint)


def _check_slots(text: Text, head: TaskFields, where: str) -> None:
    bases = {name.partition(".")[0] for name in head.stated}
    known = GIVEN | set(head.stated) | bases
    for name in slots_in(text):
        if name.removeprefix("rival ") not in known:
            _fail(where, f"has the slot {name!r}; known: {', '.join(sorted(known))}")


def _check_pointers(text: Text, fields: ScenarioFields, where: str) -> None:
    """Check that every pointer is one of the closed table."""
    for pointer in pointers_in(text):
        kind = type_of(pointer.of, fields.list)
        if row_of(text, pointer, kind) is None:
            of_kind = [one.words for one in pointer_table() if kind in one.of]
            _fail(
                where,
                f"has the pointer <{pointer.expression} {pointer.of}: {pointer.words}>, which is "
                f"not in pointers.toml; for a {kind} there are: {'; '.join(of_kind) or 'none'}",
            )


def type_of(name: str, listed: str = "") -> str:
    """Return the type of what a slot stands for, as in ``of`` of the table of pointers."""
    base, _, number = name.partition(".")
    if base in ("list", "taken"):
        several = base == "list" and not number
        return "pair" if several else SLOT_TYPE_NAMES[listed or "color"]
    if base == "colors":
        return "color" if number else "colors"
    return SLOT_TYPE_NAMES.get(base, base)


@functools.cache
def row_of(text: Text, pointer: Pointer, kind: str) -> PointerRow | None:
    """Return the row of the table for a pointer in its sentence; None if there is none."""
    said = "".join(map(_said, text))
    of_kind = [row for row in pointer_table() if row.kind == pointer.expression and kind in row.of]
    relations = [
        row for row in of_kind if f"<{pointer.words}>" in row.words and row.words in said
    ]  # fmt: skip
    alone = [row for row in of_kind if row.words == pointer.words]
    return next(iter((*relations, *alone)), None)


def _said(part: Part) -> str:
    """Return a part as the table has it: the noun of a step is any."""
    if isinstance(part, Pointer):
        return f"<{part.words}>"
    if isinstance(part, Agreement):
        return f"[{part.controller}: {part.one}|{part.many}]"
    if isinstance(part, Slot):
        form = "*" if part.name == "step" and part.form else part.form
        return f"{{{part.name}:{form}}}" if form else f"{{{part.name}}}"
    return part


def _flat(table: object, prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the entries of a table whose keys may hold dots: ``colors.0`` is one."""
    if not isinstance(table, dict):
        yield prefix, table
        return
    for name, value in table.items():
        yield from _flat(value, f"{prefix}.{name}" if prefix else name)


def _parsed(text: str, where: str) -> Text:
    if not (text.isascii() and (text.isprintable() or not text)):
        _fail(where, f"has the words {text!r}; they must be printable ASCII on one line")
    try:
        return parse(text)
    except ValueError as error:
        raise InvalidValueError(f"{where}: {error}.") from error


def _toml(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except ValueError as error:
        raise InvalidValueError(f"{where} is not valid TOML: {error}.") from error


def _as(kind: type[Stored], data: object, where: str) -> Stored:
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        raise InvalidValueError(f"{where}: {error}.") from error


def _fail(where: str, complaint: str) -> NoReturn:
    raise InvalidValueError(f"{where} {complaint}.")


def read_scenario_file(path: Path) -> TaskScenarios:
    """Read a file of scenarios from anywhere."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise InvalidValueError(f"The file {str(path)!r} cannot be read: {error}.") from error
    return read_task_scenarios(text, path.name)
