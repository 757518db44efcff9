"""Read the data files of words; every mistake of a file is named by scenario and field.

- *head*: the content of a file with its tables as they were written.
- *commands*: skeletons of a task, *Pick up {color}*; *stated*: the words that state each field.
- *frame*: the short name of a scenario; *sentence*: one of its texts, with marks.
- *table of pointers*: ``pointers.toml``, with a row for all words that may point back.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roboirg.core.episode import SUITES
from roboirg.core.errors import InvalidValueError
from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.core.word_pools import POOLS, PoolName
from roboirg.language.phrases import TaggedText
from roboirg.language.request import AMOUNT_FIELD
from roboirg.language.scenarios.literals import Literals, read_literals
from roboirg.language.scenarios.markup import (
    Part,
    Pointer,
    Slot,
    Text,
    parse,
    pointers_in,
    slots_in,
)
from roboirg.language.scenarios.relations import EVERY_RELATION
from roboirg.language.scenarios.scenario import (
    COMMANDS,
    PEOPLE,
    FileFields,
    General,
    PointerRow,
    Scenario,
    ScenarioFields,
    Sentences,
    TaskScenarios,
    Texts,
)
from roboirg.language.scenarios.scenario_needs import check_needs, sentence_names, slots_of
from roboirg.language.scenarios.written import (
    Mistakes,
    converted,
    data_of,
    fields_of,
    shown,
    text_of,
)
from roboirg.language.settings import all_settings
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task, all_tasks, every_task

FOLDER = Path(__file__).parent
ALL = "all"
"""Instead of a task: for all tasks of a file."""
PRONOUNS = {"he": ("he", "him", "his", "his"), "she": ("she", "her", "her", "hers")}
GIVEN = frozenset(
    {
        "list", "list.0", "list.1", "list.2", "rank", "reference", "step", "taken",
        "place", "place.0", "place.1", "clue", "clue.0", "clue.1", "beside", "counted",
        "aside.0", "aside.1", "rest", "kept", "excluded", "excluded.0", "excluded.1", *PEOPLE,
    }
)  # fmt: skip
"""Slots that are no fields of the goal."""
_SEVERAL = ("say.", "remarks.", "distractors", "competing")
"""The fields of which each sentence may be a list of alternatives."""


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
    return _words_of(every_task().get(task)).get(task)


def written_words() -> Mapping[str, TaskScenarios]:
    """Return the words of each of our tasks that has some, the real robot's included."""
    found: dict[str, TaskScenarios] = {}
    for task in all_tasks(SUITES):
        words = task_scenarios(task)
        if words is not None:
            found[task] = words
    return found


@functools.cache
def setting_scenarios(setting: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a setting's own file serves; empty if it names none."""
    return _words_of(all_settings().get(setting))


def _words_of(owner: Task | Setting | None) -> Mapping[str, TaskScenarios]:
    """Return what the file that a task or setting names for its words has for each task."""
    path = _named_file(owner)
    return read_scenario_file(path) if path else {}


def words_in(setting: str, task: str) -> TaskScenarios | None:
    """Return the words of a task in a setting; None if none have been written.

    They stand in the setting's own file if it serves the task, and else in the task's file.
    """
    return setting_scenarios(setting).get(task) or task_scenarios(task)


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


def read_task_scenarios(text: str, where: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a file serves; `where` names the file in complaints.

    Raises:
        InvalidValueError: it is not as `docs/add-scenario.md` says; a line for each mistake.
    """
    head = read_head(text, where)
    if head.name or head.literal:
        raise InvalidValueError(
            f"{where} has a name or a [[literal]], which only wording files have; remove it from "
            "the file of a task or setting."
        )
    return tasks_in(head, where)


# Cached: each task that a file serves asks for its head.
@functools.lru_cache(maxsize=8)
def read_head(text: str, where: str) -> FileFields:
    """Return the content of a file of words, checked for its fields; its tables are as written.

    `where` names the file in messages.

    Raises:
        InvalidValueError: it is no TOML, lacks tasks, or has fields that no such file has.
    """
    data = data_of(text, where)
    for task in every_task():
        if task in data:
            raise InvalidValueError(
                f"{where} has the table [{task}] of an earlier format; write its commands under "
                "[commands], and import RoboMME's sentences again with `roboirg language "
                "import-robomme`."
            )
    mistakes = Mistakes(where)
    head = fields_of(data, FileFields, mistakes)
    mistakes.refuse()
    if head is None or not head.tasks:
        raise InvalidValueError(f'{where} has no tasks; add a line such as tasks = ["PickXtimes"].')
    return head


def tasks_in(head: FileFields, where: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a file serves; raise one error with all of its mistakes.

    The words are commands, words that state values, and scenarios. A task for which the file has no
    commands has those of its own file; so does each stated value.
    """
    mistakes = Mistakes(where)
    mistakes.check_names("task", head.tasks, every_task())
    mistakes.check_names("task", [*head.commands, *head.stated], (*head.tasks, ALL))
    mistakes.refuse()
    literals = read_literals(head.literal, head.tasks, mistakes)
    mistakes.refuse()  # without its sentences a task would seem to lack commands
    words: dict[str, TaskScenarios] = {}
    for task in head.tasks:
        words[task] = _command_words(head, task, literals[task], mistakes)
    _check_stated(head, words, mistakes)
    _add_scenarios(head, words, mistakes)
    mistakes.refuse()
    return words


def _check_stated(head: FileFields, words: Mapping[str, TaskScenarios], mistakes: Mistakes) -> None:
    """Check that a file states values of fields that its tasks have."""
    for owner, texts in head.stated.items():
        known = words[owner].stated if owner in words else _stated_in(words)
        mistakes.at(f"stated.{owner}").check_names("field", texts, known)


def _add_scenarios(
    head: FileFields, words: Mapping[str, TaskScenarios], mistakes: Mistakes
) -> None:
    """Add each scenario of a file to the words of the tasks that it serves: its own, or all."""
    for scenario in _scenarios(head, _stated_in(words), mistakes):
        served = scenario.fields.needs.tasks or head.tasks
        for task, task_words in words.items():
            if task in served:
                task_words.scenarios.append(scenario)


def _stated_in(words: Mapping[str, TaskScenarios]) -> dict[str, Text]:
    """Return what states each field in any of some tasks."""
    stated: dict[str, Text] = {}
    for task_words in words.values():
        stated |= task_words.stated
    return stated


def _of_task(tables: Mapping[str, Any], task: str) -> dict[Any, Any]:
    """Return what a table of a file has for a task: entries for all tasks, then its own, which win.

    A list is for both pools: ``["Lift it."]`` becomes ``{"train": [...], "test": [...]}``.
    """
    entries: dict[Any, Any] = {}
    for owner in (ALL, task):
        table = tables.get(owner, {})
        if isinstance(table, tuple):
            table = dict.fromkeys(POOLS, table)
        entries |= table
    return entries


def _command_words(
    head: FileFields, task: str, literals: Literals, mistakes: Mistakes
) -> TaskScenarios:
    """Return a task's commands and words that state values, with no scenarios yet.

    What the file lacks is taken from the file that the task names for its words.
    """
    path = _named_file(every_task().get(task))
    task_head = head
    if path is not None:
        task_head = read_head(text_of(path), path.name)

    own_stated = _of_task(head.stated, task)
    stated = _stated_texts(_of_task(task_head.stated, task), own_stated, mistakes)
    own_parts = list(own_stated)
    commands = _of_task(task_head.commands, task)
    if ALL in head.commands or task in head.commands:
        commands = _of_task(head.commands, task)
        own_parts.append(COMMANDS)
    # Whole sentences need no commands: a task without words of ours may have nothing else.
    if COMMANDS in own_parts or commands or not literals:
        _check_commands(commands, task, stated, mistakes)
    return TaskScenarios(commands, stated, [], mistakes.where, literals, own_parts)


def _stated_texts(
    usual: Mapping[str, str], own: Mapping[str, str], mistakes: Mistakes
) -> dict[str, Text]:
    """Return the words that state each field of a task: a file's own, or else the usual ones.

    ``{"color": <the {color} cube>}``. A mistake is added for words with marks other than their own
    value.
    """
    stated: dict[str, Text] = {}
    for name, usual_text in usual.items():
        part = mistakes.at(f"stated {name}")
        text = _parsed(own.get(name, usual_text), part)
        slot = "amounts" if name == AMOUNT_FIELD else name
        other_slots = set(slots_in(text)) - {slot}  # it may say its own value only
        if other_slots or any(pointers_in(text)):
            part.add(f"has other marks than those of {{{slot}}}")
        stated[name] = text
    return stated


def _check_commands(
    commands: Mapping[PoolName, Texts], task: str, stated: Collection[str], mistakes: Mistakes
) -> None:
    """Add a mistake for each pool without commands, and for each command with unknown marks.

    A command may only have marks for values that are stated, ``{color}``.
    """
    part = mistakes.at(f"commands of {task}")
    for pool in POOLS:
        texts = commands.get(pool, ())
        if not texts:
            mistakes.add(f"has no commands of {task} in the pool {pool}")
        for text in texts:
            _check_command(text, stated, part)


def _check_command(text: str, stated: Collection[str], mistakes: Mistakes) -> None:
    """Check that a command has no marks but values that are stated: ``{color}``."""
    for mark in _parsed(text, mistakes):
        is_plain = isinstance(mark, TaggedText)
        is_value = isinstance(mark, Slot) and mark.form is None and mark.name in stated
        if not is_plain and not is_value:
            names = " and ".join(f"{{{name}}}" for name in stated)
            mistakes.add(f"has other marks than {names}: {shown(text)}")


def _scenarios(head: FileFields, stated: Collection[str], mistakes: Mistakes) -> Iterator[Scenario]:
    """Yield the scenarios of a file whose fields are right; add a mistake for all others.

    A frame, which is the name of a scenario, may be there once for each setting and pool.
    """
    settings_by_frame: dict[str, set[str]] = {}  # by frame: the settings with pools that have it
    # In files of users, which have a name, a scenario without a pool is for both.
    default_fields: dict[str, Any] = {"pool": None} if head.name else {}
    for number, table in enumerate(head.scenario, 1):
        part = mistakes.at(f"scenario {shown(table.get('frame', number))}")
        scenario = _scenario(default_fields | table, stated, part)
        if scenario is None:
            continue
        part.at("needs.tasks").check_names("task", scenario.fields.needs.tasks, head.tasks)
        settings_before = settings_by_frame.setdefault(scenario.fields.frame, set())
        settings = _settings_of(scenario)
        if settings & settings_before:
            part.add(f"stands twice in the setting {min(settings & settings_before)}")
        settings_before |= settings
        yield scenario


def _settings_of(scenario: Scenario) -> set[str]:
    """Return the setting of a scenario with each of its pools: ``direct, train``."""
    fields = scenario.fields
    pools = POOLS if fields.pool is None else (fields.pool,)
    return {f"{fields.setting}, {pool}" for pool in pools}


def _scenario(
    table: Mapping[str, Any], stated: Collection[str], mistakes: Mistakes
) -> Scenario | None:
    """Return the scenario that a table of the file holds; None if a field has a mistake.

    Each mistake is added. What its fields need of each other is checked once each of them is right.
    """
    flat_table = _flat_table(table)
    fields = fields_of(flat_table, ScenarioFields, mistakes, sentence_names(stated))
    texts = _sentences(flat_table, fields, stated, mistakes)
    if fields is None:
        return None
    _check_names(fields, mistakes.at("frame or people"))
    said = tuple(name for name in sorted(stated) if f"say.{name}" in texts)
    scenario = Scenario(fields, texts, _people(fields, texts), said)
    check_needs(scenario, stated, mistakes)
    return scenario


def _check_names(fields: ScenarioFields, mistakes: Mistakes) -> None:
    """Check that the frame and the people of a scenario are plain words."""
    _parsed(fields.frame, mistakes)
    for names in (fields.people or {}).values():
        for name in names:
            _parsed(name, mistakes)


def _flat_table(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's table with its sentences by full name: ``say.color``, not ``say``."""
    flat: dict[str, Any] = {}
    for name, value in table.items():
        if name in ScenarioFields.__struct_fields__:
            flat[name] = value
        else:
            flat.update(_flat(value, name))
    return flat


def _sentences(
    flat: Mapping[str, Any],
    fields: ScenarioFields | None,
    stated: Collection[str],
    mistakes: Mistakes,
) -> Sentences:
    """Return the sentences of a scenario by field, such as ``say.color``; mistakes are added.

    `flat` has the scenario's table with full names, and `stated` the fields of the task's commands.
    """
    reader = _SentenceReader(str(flat.get("list", "")), _operations(fields), _known_slots(stated))
    texts: dict[str, tuple[Text, ...]] = {}
    names = sentence_names(stated)
    for name, value in flat.items():
        if name not in names:
            continue
        alternatives = [value]  # most fields have one sentence only
        if isinstance(value, list) and name.startswith(_SEVERAL):
            alternatives = value
        part = mistakes.at(name)
        texts[name] = tuple(reader.read(text, part) for text in alternatives)
    return texts


def _operations(fields: ScenarioFields | None) -> set[str]:
    """Return the operations, ``minus`` or ``after``, that the relations of a scenario stand for."""
    operations: set[str] = set()
    if fields is not None and fields.derive is not None:
        for name in fields.derive.relations:
            if name in EVERY_RELATION:
                operations.add(EVERY_RELATION[name].operation)
    return operations


def _people(fields: ScenarioFields, texts: Sentences) -> tuple[Texts, ...]:
    """Return the people of whom a scenario can speak, with pronouns; empty if it names none.

    One is ``("Leo", "he", "him", "his", "his")``.
    """
    slots: set[str] = set()
    for alternatives in texts.values():
        for text in alternatives:
            slots.update(slots_in(text))
    if PEOPLE.isdisjoint(slots):
        return ()
    people: list[Texts] = []
    for pronoun, names in (fields.people or general().people).items():
        for name in names:
            people.append((name, *PRONOUNS[pronoun]))
    return tuple(people)


def _known_slots(stated: Collection[str]) -> frozenset[str]:
    """Return the slots of which sentences can speak."""
    slots = slots_of(stated)
    rivals = {f"rival {name}" for name in slots if name.isalpha() and name != AMOUNT_FIELD}
    return GIVEN | slots | rivals


@functools.cache
def _pattern(words: str) -> re.Pattern[str]:
    """Return a pattern for the words of a row of the table, with any noun for ``*``.

    ``**`` is any words.
    """
    any_words = "[A-Za-z{}' ]+"
    any_noun = "[a-z]+"
    pattern = re.escape(words).replace(r"\*\*", any_words).replace(r"\*", any_noun)
    return re.compile(pattern)


def _is_said(row: PointerRow, words: str, sentence: str) -> bool:
    """Return whether a row of the table is for the words of a pointer.

    The words of a row may stand in others, ``of <those>``: then the sentence must have these as
    well.
    """
    if "<" in row.words:
        return f"<{words}>" in row.words and _pattern(row.words).search(sentence) is not None
    return _pattern(row.words).fullmatch(words) is not None


@dataclass(frozen=True)
class _SentenceReader:
    """Reads the sentences of a scenario.

    Attributes:
        listed: the slot of which the scenario introduces a list; empty if it does not.
        operations: those of the relations that it can say.
        slots: of which its sentences can speak.
    """

    listed: str
    operations: Collection[str]
    slots: Collection[str]

    def read(self, text: object, mistakes: Mistakes) -> Text:
        """Return the parts of a sentence, with what its pointers, words that point back, mean.

        The table of pointers says what they mean. Mistakes are added: unknown slots, and words
        that are not in the table.
        """
        parts = _parsed(text, mistakes)
        mistakes.check_names("slot", slots_in(parts), self.slots)
        parts_read: list[Part] = []
        for part in parts:
            if isinstance(part, Pointer):
                parts_read.append(self._pointing(part, str(text), mistakes))
            else:
                parts_read.append(part)
        return tuple(parts_read)

    def _pointing(self, pointer: Pointer, sentence: str, mistakes: Mistakes) -> Pointer:
        """Return a pointer of a sentence with what its row in the table of pointers says.

        Of rows for the same words, such as *that one*, that of the scenario's relations is taken:
        *one earlier* or *one later*. Without a row of its class, the mistake is added.
        """
        kind = type_of(pointer.of, self.listed)
        said = re.sub(r"<[^:<>]+: ", "<", sentence)  # as the table has it: without class and slot
        rows = [row for row in _rows_of(kind) if _is_said(row, pointer.words, said)]
        # Rows with the words around them come first, then those of the relations.
        rows.sort(key=lambda row: ("<" not in row.words, row.operation not in self.operations))
        for row in rows:
            if row.kind == pointer.expression:
                return pointer._replace(resolved=parse(row.resolved), operation=row.operation)
        mistakes.add(_wrong_pointer(pointer, sentence, kind, rows))
        return pointer


def _rows_of(kind: str) -> list[PointerRow]:
    """Return the rows of the table that point back at a type of value."""
    return [row for row in pointer_table() if kind in row.of]


def _wrong_pointer(pointer: Pointer, sentence: str, kind: str, rows: Sequence[PointerRow]) -> str:
    """Return the complaint about a pointer: its words have another class, or no row at all.

    Args:
        pointer: as written.
        sentence: that has it.
        kind: the type of what it stands for.
        rows: those for its words, of other classes.
    """
    found = f"has the pointer <{pointer.expression} {pointer.of}: {pointer.words}>"
    if rows:
        classes = " or ".join(dict.fromkeys(repr(row.kind) for row in rows))
        return f"{found}; in pointers.toml these words have the class {classes} for a {kind}"
    import difflib  # here, because only a mistake needs it

    known = {_written(row, pointer.of) for row in _rows_of(kind)}
    nearest = difflib.get_close_matches(sentence, known, n=5, cutoff=0)
    return (
        f"{found}, which does not exist; the nearest for a {kind}: "
        f"{'; '.join(nearest) or 'none'} (* is any noun); docs/scenario-marks.md has all"
    )


def _written(row: PointerRow, of: str) -> str:
    """Return a row of the table as authors write it, with class and slot."""
    begun = f"<{row.kind} {of}: "
    if "<" in row.words:
        return row.words.replace("<", begun)
    return f"{begun}{row.words}>"


def type_of(name: str, listed: str = "") -> str:
    """Return the type of the value that a slot holds, as the table of pointers names it.

    ``repeats`` gives ``number`` and ``list`` gives ``pair``; ``list.0`` and ``taken`` have the type
    of what is listed, the slot `listed`.
    """
    base, _, number = name.partition(".")
    if not number and base == "list":
        return "pair"
    if not number and base == "colors":
        return "colors"
    if base in ("list", "taken"):
        base = listed or "color"
    return SLOT_TYPE_NAMES.get(base, base)


def _flat(value: object, name: str) -> Iterator[tuple[str, object]]:
    """Yield the entries of a table whose keys may hold dots: ``colors.0`` is one."""
    if not isinstance(value, dict) or not value:
        yield name, value
        return
    for key, inner in value.items():
        yield from _flat(inner, f"{name}.{key}")


def _parsed(text: object, mistakes: Mistakes) -> Text:
    """Return the parts of a sentence; of one with a mistake, which is added, the words."""
    try:
        return parse(text)
    except ValueError as error:
        mistakes.add(str(error))
        return (TaggedText(shown(text)),)


def read_scenario_file(path: Path) -> Mapping[str, TaskScenarios]:
    """Read a file of scenarios from anywhere, like `read_task_scenarios`."""
    return read_task_scenarios(text_of(path), path.name)
