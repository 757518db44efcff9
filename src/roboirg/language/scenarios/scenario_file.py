"""Read the data files of language 4; every mistake of a file is named by scenario and field."""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.core.word_pools import POOLS
from roboirg.language.phrases import TaggedText
from roboirg.language.request import AMOUNT_FIELD
from roboirg.language.scenarios.amounts import SLOTS
from roboirg.language.scenarios.markup import Pointer, Text, parse, slots_in
from roboirg.language.scenarios.scenario import (
    PEOPLE,
    REMARKS,
    FileFields,
    General,
    PointerRow,
    Scenario,
    ScenarioFields,
    TaskScenarios,
    Texts,
)
from roboirg.tasks import every_task

FOLDER = Path(__file__).parent
Stored = TypeVar("Stored")
ALL = "all"
"""Instead of a task: for all tasks of a file."""
PRONOUNS = {"he": ("he", "him", "his", "his"), "she": ("she", "her", "her", "hers")}
GIVEN = frozenset(
    {"list", "list.0", "list.1", "list.2", "rank", "reference", "step", "taken"}
    | {"place", "place.0", "place.1", "clue", "clue.0", "clue.1", "aside.0", "aside.1", "rest"}
    | {"kept", "excluded", "excluded.0", "excluded.1"}
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
    return _as(kind, _text_of(FOLDER / name), name)


@functools.cache
def task_scenarios(task: str) -> TaskScenarios | None:
    """Return the words of a task; None if none have been written."""
    path = own_file(task)
    return read_scenario_file(path).get(task) if path else None


def own_file(task: str) -> Path | None:
    """Return the file that a task names for its words; None if it names none."""
    found = every_task().get(task)
    if found is None or not found.words:
        return None
    return FOLDER / found.words  # a whole path stays as it is


def read_task_scenarios(text: str, where: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a file serves; `where` names the file in complaints.

    A file without commands of a task takes those of the task's own file.

    Raises:
        InvalidValueError: it is not as `docs/add-scenario.md` says; a line for each mistake.
    """
    head = _as(FileFields, text, where)
    check_names(f"task of {where} named", head.tasks, every_task())
    check_names(f"task of {where} named", [*head.commands, *head.stated], (*head.tasks, ALL))
    mistakes: list[str] = []
    words = {task: _command_words(head, task, where, mistakes) for task in head.tasks}
    stated = dict[str, Text]()
    for of_task in words.values():
        stated |= of_task.stated
    scenarios = [
        _scenario(one, stated, f"{where}, scenario {one.get('frame', number)!r}", mistakes)
        for number, one in enumerate(head.scenario, 1)
    ]
    names = [[one.get(part) for part in ("frame", "setting", "pool")] for one in head.scenario]
    mistakes += [
        f"{where} has the frame {name[0]!r} twice in the setting {name[1]}, {name[2]}."
        for at, name in enumerate(names)
        if name in names[:at] and None not in name
    ]
    if mistakes:
        raise InvalidValueError("\n".join(mistakes))
    for scenario in filter(None, scenarios):
        needed = scenario.fields.needs.tasks
        kind = f"task of {where}, scenario {scenario.fields.frame!r}, needs.tasks, named"
        check_names(kind, needed, head.tasks)
        for task in needed or head.tasks:
            words[task].scenarios.append(scenario)
    return words


def _command_words(head: FileFields, task: str, where: str, mistakes: list[str]) -> TaskScenarios:
    """Return the words of a task without scenarios: its commands, and the values they state."""
    path = own_file(task)
    if path and not {ALL, task} & head.commands.keys():
        where = path.name
        head = _as(FileFields, _text_of(path), where)
    texts = {**head.stated.get(ALL, {}), **head.stated.get(task, {})}
    stated = {
        name: _sentence(text, "", texts, f"{where}, stated", mistakes)
        for name, text in texts.items()
    }
    written = {**head.commands.get(ALL, {}), **head.commands.get(task, {})}
    for pool in POOLS:
        if not written.get(pool):
            mistakes.append(f"{where} has no commands of {task} in the pool {pool}.")
        for command in written.get(pool, ()):
            _sentence(command, "", texts, f"{where}, commands of {task}", mistakes)
    return TaskScenarios(written, stated, [])


def _scenario(
    written: Mapping[str, Any], stated: Collection[str], where: str, mistakes: list[str]
) -> Scenario | None:
    """Return a scenario; None if the file has mistakes, to which those of the scenario are added.

    What its fields need of each other is checked once each of them is right.
    """
    fields = _fields(written, where, mistakes)
    listed = str(written.get("list", ""))
    sentences = {name: written[name] for name in written if name in SENTENCES}
    texts: dict[str, tuple[Text, ...]] = {}
    for name, value in _flat(sentences):
        several = value if isinstance(value, list) else [value]
        at = f"{where}, {name}"
        texts[name] = tuple(_sentence(one, listed, stated, at, mistakes) for one in several)
    said = tuple(sorted(name.removeprefix("say.") for name in texts if name.startswith("say.")))
    if fields is not None:
        mistakes += [f"{where} {one}." for one in _unmet(fields, texts, said, stated)]
    if fields is None or mistakes:
        return None
    return Scenario(fields, texts, _people(fields, texts), said)


def _people(
    fields: ScenarioFields, texts: Mapping[str, tuple[Text, ...]]
) -> tuple[tuple[str, ...], ...]:
    """Return who can be spoken of, each with his or her pronouns, if the sentences speak of any."""
    said = (name for several in texts.values() for text in several for name in slots_in(text))
    if PEOPLE.isdisjoint(said):
        return ()
    people = fields.people or general().people
    return tuple((name, *PRONOUNS[one]) for one, names in people.items() for name in names)


def _fields(written: Mapping[str, Any], where: str, mistakes: list[str]) -> ScenarioFields | None:
    """Return what a scenario has besides sentences; None if it has mistakes."""
    before, found = len(mistakes), dict[str, Any]()
    for one in msgspec.structs.fields(ScenarioFields):
        if one.required and one.name not in written:
            mistakes.append(f"{where} has no {one.name}.")
        elif one.name in written:
            try:
                found[one.name] = msgspec.convert(written[one.name], one.type)
            except msgspec.ValidationError as error:
                mistakes.append(f"{where}, {one.name}: {error}.")
    known = SENTENCES.union(ScenarioFields.__struct_fields__)
    mistakes += [
        f"{where} has the field {name!r}; the fields are {', '.join(sorted(known))}."
        for name in written
        if name not in known
    ]
    return ScenarioFields(**found) if len(mistakes) == before else None


def _unmet(
    fields: ScenarioFields,
    texts: Mapping[str, tuple[Text, ...]],
    said: Texts,
    stated: Collection[str],
) -> list[str]:
    """Return what the fields of a scenario need of each other and do not have."""
    needed = ["introduction", *(_CONTEXTUAL if fields.setting == "direct" else ())]
    if fields.setting == "direct-rival":
        needed += [f"remarks.{name}" for name in REMARKS]
    lacking = [name for name in needed if not any(texts.get(name, ()))]
    unknown = sorted(set(said) - set(stated))
    slots = _slots(stated)
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
        "has a single person; another one must be possible": (
            sum(map(len, (fields.people or {}).values())) == 1
        ),
        f"has a list of {fields.list!r}; the slots are {', '.join(sorted(slots))}": (
            fields.list and fields.list not in slots
        ),
    }
    return [complaint for complaint, holds in wrong.items() if holds]


def _slots(stated: Collection[str]) -> set[str]:
    """Return the slots of a task, and its fields: ``colors`` and ``colors.0``."""
    if AMOUNT_FIELD in stated:
        return {*SLOTS, *stated}
    return {*stated, *(name.partition(".")[0] for name in stated)}


def _sentence(
    text: object, listed: str, stated: Collection[str], where: str, mistakes: list[str]
) -> Text:
    """Return a sentence, with the rows of the closed table for what points back."""
    parts = _parsed(text, where, mistakes)
    known = GIVEN | _slots(stated)
    mistakes += [
        f"{where} has the slot {name!r}; known: {', '.join(sorted(known))}."
        for name in slots_in(parts)
        if name.removeprefix("rival ") not in known
    ]
    said = re.sub(r"<[^:<>]+: ", "<", str(text))  # as the table has it: without class and slot
    return tuple(
        _pointing(one, said, type_of(one.of, listed), where, mistakes)
        if isinstance(one, Pointer)
        else one
        for one in parts
    )


def _is_said(row: PointerRow, words: str, sentence: str) -> bool:
    """Return whether a row of the table is for the words of a pointer, with any noun for ``*``."""
    pattern = re.escape(row.words).replace(r"\*", "[a-z]+")
    if "<" in row.words:  # with the words around them
        return f"<{words}>" in row.words and re.search(pattern, sentence) is not None
    return re.fullmatch(pattern, words) is not None


def _pointing(pointer: Pointer, said: str, kind: str, where: str, mistakes: list[str]) -> Pointer:
    """Return a pointer with what its row says."""
    words = pointer.words
    of_kind = [row for row in pointer_table() if kind in row.of]
    rows = [row for row in of_kind if _is_said(row, words, said)]
    rows.sort(key=lambda row: "<" not in row.words)  # with the words around them first
    row = next((row for row in rows if row.kind == pointer.expression), None)
    if row is None:
        found = f"{where} has the pointer <{pointer.expression} {pointer.of}: {words}>"
        classes = " or ".join(dict.fromkeys(repr(one.kind) for one in rows))
        known = "; ".join(_written(one, pointer.of) for one in of_kind) or "none"
        mistakes.append(
            f"{found} of the class {pointer.expression!r}; in pointers.toml the words {words!r} "
            f"have the class {classes} for a {kind}."
            if rows
            else f"{found}, which is not in pointers.toml; for a {kind} there are: {known}."
        )
        return pointer
    return pointer._replace(resolved=parse(row.resolved), operation=row.operation)


def _written(row: PointerRow, of: str) -> str:
    """Return a row of the table as authors write it, with class and slot."""
    begun = f"<{row.kind} {of}: "
    return row.words.replace("<", begun) if "<" in row.words else f"{begun}{row.words}>"


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


def _parsed(text: object, where: str, mistakes: list[str]) -> Text:
    """Return the parts of a sentence; of one with a mistake, which is added, the words."""
    try:
        return parse(text)
    except ValueError as error:
        mistakes.append(f"{where} {error}.")
        return (TaggedText(str(text)),)


def _as(kind: type[Stored], text: str, where: str) -> Stored:
    """Return data of a type from TOML."""
    try:
        return msgspec.toml.decode(text, type=kind)
    except (ValueError, msgspec.MsgspecError) as error:
        raise InvalidValueError(f"{where}: {error}.") from error


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise InvalidValueError(f"The file {str(path)!r} cannot be read: {error}.") from error


def read_scenario_file(path: Path) -> Mapping[str, TaskScenarios]:
    """Read a file of scenarios from anywhere, like `read_task_scenarios`."""
    return read_task_scenarios(_text_of(path), path.name)
