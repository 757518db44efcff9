"""Read the data files of language 4; every mistake of a file is named by scenario and field."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.core.word_pools import POOLS, PoolName
from roboirg.language.phrases import TaggedText
from roboirg.language.request import AMOUNT_FIELD
from roboirg.language.scenarios.amounts import SLOTS
from roboirg.language.scenarios.literals import Literals, read_literals
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
from roboirg.language.scenarios.written import converted, data_of, text_of
from roboirg.language.settings import all_settings
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task, all_tasks, every_task

FOLDER = Path(__file__).parent
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
    name = "pointers.toml"
    return converted(_shared(name), dict[str, tuple[PointerRow, ...]], name)["pointer"]


@functools.cache
def general() -> General:
    """Return what all tasks share."""
    return converted(_shared("general.toml"), General, "general.toml")


def _shared(name: str) -> dict[str, Any]:
    return data_of(text_of(FOLDER / name), name)


@functools.cache
def task_scenarios(task: str) -> TaskScenarios | None:
    """Return the words of a task; None if none have been written."""
    path = own_file(task)
    return read_scenario_file(path).get(task) if path else None


def written_words() -> Mapping[str, TaskScenarios]:
    """Return the words of each of our tasks that has some."""
    found: dict[str, TaskScenarios] = {}
    for task in all_tasks():
        words = task_scenarios(task)
        if words is not None:
            found[task] = words
    return found


@functools.cache
def setting_scenarios(setting: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a setting's own file serves; empty if it names none."""
    path = _named_file(all_settings().get(setting))
    return read_scenario_file(path) if path else {}


def words_in(setting: str, task: str) -> TaskScenarios | None:
    """Return the words of a task in a setting; None if none have been written.

    They stand in the setting's own file if it serves the task, and else in the task's file.
    """
    return setting_scenarios(setting).get(task) or task_scenarios(task)


def own_file(task: str) -> Path | None:
    """Return the file that a task names for its words; None if it names none."""
    return _named_file(every_task().get(task))


def _named_file(owner: Task | Setting | None) -> Path | None:
    """Return the file that a task or setting names for its words; None if it names none."""
    if owner is None or not owner.words:
        return None
    path = FOLDER / owner.words  # a whole path stays as it is
    if not path.is_file():
        raise InvalidValueError(
            f"The words of {owner.name} are {str(path)!r}, which is no file; name it by its whole "
            "path."
        )
    return path


def scenario_settings() -> Mapping[str, Setting]:
    """Return the settings that scenarios are written for; contextual says those of direct."""
    others = ("", "explicit", "contextual")
    return {one.name: one for one in all_settings().values() if one.offers not in others}


def read_task_scenarios(text: str, where: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a file serves; `where` names the file in complaints.

    Raises:
        InvalidValueError: it is not as `docs/add-scenario.md` says; a line for each mistake.
    """
    return tasks_in(read_head(text, where), where)


# Cached: each task that a file serves asks for its head.
@functools.lru_cache(maxsize=8)
def read_head(text: str, where: str) -> FileFields:
    """Return the content of a file with its tables as they were written."""
    data = data_of(text, where)
    for task in every_task():
        if task in data:
            raise InvalidValueError(
                f"{where} has the table [{task}] of an earlier format; write its commands under "
                "[commands], and import RoboMME's sentences again with `roboirg language "
                "import-robomme`."
            )
    check_names(f"key of {where} named", data, FileFields.__struct_fields__)
    if "tasks" not in data:
        raise InvalidValueError(f'{where} has no tasks; add a line such as tasks = ["PickXtimes"].')
    fields: dict[str, Any] = {}
    for field in msgspec.structs.fields(FileFields):
        if field.name in data:
            fields[field.name] = converted(data[field.name], field.type, f"{where}, {field.name}")
    return FileFields(**fields)


def tasks_in(head: FileFields, where: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a file serves, like `read_task_scenarios`.

    A task for which it has no commands has those of its own file; so does each stated value.
    """
    check_names(f"task of {where} named", head.tasks, every_task())
    check_names(f"task of {where} named", [*head.commands, *head.stated], (*head.tasks, ALL))
    mistakes: list[str] = []
    literals = read_literals(head.literal, head.tasks, where, mistakes)
    words = {
        task: _command_words(head, task, literals[task], where, mistakes) for task in head.tasks
    }
    stated = dict[str, Text]()
    for of_task in words.values():
        stated |= of_task.stated
    usual: dict[str, Any] = {"pool": None} if head.name else {}
    scenarios = [
        _scenario(usual | one, stated, f"{where}, scenario {one.get('frame', number)!r}", mistakes)
        for number, one in enumerate(head.scenario, 1)
    ]
    seen: set[str] = set()
    for one in head.scenario:
        frame, setting, pool = one.get("frame"), one.get("setting"), one.get("pool", "both pools")
        name = f"{where} has the frame {frame!r} twice in the setting {setting}, {pool}."
        if name in seen and None not in (frame, setting):
            mistakes.append(name)
        seen.add(name)
    if mistakes:
        # A sentence that serves several pools or tasks is read for each of them.
        raise InvalidValueError("\n".join(dict.fromkeys(mistakes)))
    for scenario in filter(None, scenarios):
        needed = scenario.fields.needs.tasks
        kind = f"task of {where}, scenario {scenario.fields.frame!r}, needs.tasks, named"
        check_names(kind, needed, head.tasks)
        for task in needed or head.tasks:
            words[task].scenarios.append(scenario)
    return words


def _command_words(
    head: FileFields, task: str, literals: Literals, where: str, mistakes: list[str]
) -> TaskScenarios:
    """Return the words of a task without scenarios: its commands, and the values they state."""
    path = own_file(task)
    own = read_head(text_of(path), path.name) if path else head
    texts: dict[str, str] = {}
    for known in (own, head):
        texts |= {**known.stated.get(ALL, {}), **known.stated.get(task, {})}
    stated = {
        name: _sentence(text, "", texts, f"{where}, stated", mistakes)
        for name, text in texts.items()
    }
    written = _commands(head, task) or _commands(own, task)
    # Whole sentences need no commands: a task without words of ours may have nothing else.
    for pool in POOLS if written or not literals else ():
        if not written.get(pool):
            mistakes.append(f"{where} has no commands of {task} in the pool {pool}.")
        for command in written.get(pool, ()):
            _sentence(command, "", texts, f"{where}, commands of {task}", mistakes)
    return TaskScenarios(written, stated, [], where, literals)


def _commands(head: FileFields, task: str) -> dict[PoolName, Texts]:
    """Return the commands of a task by pool, as a file has them."""
    found: dict[PoolName, Texts] = {}
    for name in (ALL, task):
        commands = head.commands.get(name, {})
        if isinstance(commands, tuple):
            commands = dict.fromkeys(POOLS, commands)
        found |= commands
    return found


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
        for name in (fields.frame, *itertools.chain(*(fields.people or {}).values())):
            _parsed(name, f"{where}, frame or people", mistakes)
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
                found[one.name] = converted(written[one.name], one.type, f"{where}, {one.name}")
            except InvalidValueError as error:
                mistakes.append(str(error))
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
    settings = scenario_settings()
    if fields.setting not in settings:
        return [f"has the setting {fields.setting!r}; the settings are {', '.join(settings)}"]
    offers = settings[fields.setting].offers
    needed = ["introduction", *(_CONTEXTUAL if fields.setting == "direct" else ())]
    if offers == "direct-rival":
        needed += [f"remarks.{name}" for name in REMARKS]
    lacking = [name for name in needed if not any(texts.get(name, ()))]
    unknown = sorted(set(said) - set(stated))
    slots = _slots(stated)
    wrong = {
        f"has no say; write say.{' or say.'.join(stated)}": not said,
        f"has say.{', say.'.join(unknown)}; the fields are {', '.join(stated)}": unknown,
        f"has no {' and no '.join(lacking)}; {fields.setting} needs {', '.join(needed)}": lacking,
        "must have derive if its setting is reasoning, and only then": (
            (fields.derive is not None) != (offers == "reasoning")
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
    slots = _slots(stated)
    rivals = {f"rival {name}" for name in slots if name.isalpha() and name != AMOUNT_FIELD}
    known = GIVEN | slots | rivals
    mistakes += [
        f"{where} has the slot {name!r}; known: {', '.join(sorted(known))}."
        for name in slots_in(parts)
        if name not in known
    ]
    said = re.sub(r"<[^:<>]+: ", "<", str(text))  # as the table has it: without class and slot
    return tuple(
        _pointing(one, said, type_of(one.of, listed), where, mistakes)
        if isinstance(one, Pointer)
        else one
        for one in parts
    )


@functools.cache
def _pattern(words: str) -> re.Pattern[str]:
    """Return a pattern for the words of a row of the table, with any noun for ``*``."""
    return re.compile(re.escape(words).replace(r"\*", "[a-z]+"))


def _is_said(row: PointerRow, words: str, sentence: str) -> bool:
    """Return whether a row of the table is for the words of a pointer."""
    if "<" in row.words:  # with the words around them
        return f"<{words}>" in row.words and _pattern(row.words).search(sentence) is not None
    return _pattern(row.words).fullmatch(words) is not None


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


def read_scenario_file(path: Path) -> Mapping[str, TaskScenarios]:
    """Read a file of scenarios from anywhere, like `read_task_scenarios`."""
    return read_task_scenarios(text_of(path), path.name)
