"""Read the data files of words; every mistake of a file is named by scenario and field.

- *head*: the content of a file with its tables as they were written.
- *commands*: of a task, with slots, ``Pick up {color}.``; *stated*: the words that state the value
  of each field, ``the {color} cube``.
- *scenario*: a template for a text; *frame*: its name; *sentence*: one of its texts, with marks.
- *pointer*: words that point back (an anaphor), ``<it color: it>``; *table of pointers*:
  ``pointers.toml``, with a row for all words that may.
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
    convert,
    excerpt,
    parse_toml,
    read_table,
    read_text,
)
from roboirg.language.settings import all_settings
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task, all_tasks, every_task

FOLDER = Path(__file__).parent
ALL = "all"
"""Instead of a task: for all tasks of a file."""
PRONOUNS = {"he": ("he", "him", "his", "his"), "she": ("she", "her", "her", "hers")}
OTHER_SLOTS = frozenset(
    {
        "list", "list.0", "list.1", "list.2", "rank", "reference", "step", "taken",
        "place", "place.0", "place.1", "clue", "clue.0", "clue.1", "beside", "counted",
        "aside.0", "aside.1", "rest", "kept", "excluded", "excluded.0", "excluded.1", *PEOPLE,
    }
)  # fmt: skip
"""Slots that hold no value of the goal: people, and what only some content plans fill."""
_FIELDS_WITH_ALTERNATIVES = ("say.", "remarks.", "distractors", "competing")
"""The fields of which each sentence may be a list of alternatives."""


@functools.cache
def pointer_table() -> tuple[PointerRow, ...]:
    """Return the closed table of pointers, the words that may point back: *it*, *the latter* …."""
    name = "pointers.toml"
    return convert(_read_shared(name), dict[str, tuple[PointerRow, ...]], name)["pointer"]


@functools.cache
def general() -> General:
    """Return what all tasks share: people who can be named, and distracting remarks."""
    return convert(_read_shared("general.toml"), General, "general.toml")


def _read_shared(name: str) -> dict[str, Any]:
    """Return the data of a file of ours that all tasks share, by its name."""
    return parse_toml(read_text(FOLDER / name), name)


@functools.cache
def task_scenarios(task: str) -> TaskScenarios | None:
    """Return the words of a task from the file that it names; None if it names none.

    Raises:
        InvalidValueError: the file is missing or invalid.
    """
    return _words_in_file_of(every_task().get(task)).get(task)


def written_words() -> Mapping[str, TaskScenarios]:
    """Return the words of each of our tasks that has some, by task, the real robot's included."""
    found = {}
    for task in all_tasks(SUITES):
        words = task_scenarios(task)
        if words is not None:
            found[task] = words
    return found


@functools.cache
def setting_scenarios(setting: str) -> Mapping[str, TaskScenarios]:
    """Return the words in a setting's own file by task; empty if it names no file."""
    return _words_in_file_of(all_settings().get(setting))


def _words_in_file_of(owner: Task | Setting | None) -> Mapping[str, TaskScenarios]:
    """Return the words in the file that a task or setting names, by the tasks that the file serves.

    Empty if it names no file, or is None.
    """
    path = _named_file(owner)
    return read_task_scenarios(read_text(path), path.name) if path else {}


def words_in(setting: str, task: str) -> TaskScenarios | None:
    """Return the words of a task in a setting; None if none have been written.

    They stand in the setting's own file if it serves the task, and else in the task's file.
    """
    return setting_scenarios(setting).get(task) or task_scenarios(task)


def _named_file(owner: Task | Setting | None) -> Path | None:
    """Return the file that a task or setting names for its words; None if it names none.

    Raises:
        InvalidValueError: there is no such file.
    """
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
    """Return the words of each task that a file of ours, or of another package, serves.

    Args:
        text: of the file, TOML.
        where: names the file in messages.

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
    """Return the content of a file of words, checked for its fields; its tables stay as written.

    `where` names the file in messages.

    Raises:
        InvalidValueError: it is no TOML, lacks tasks, or has fields that no such file has.
    """
    mistakes = Mistakes(where)
    head = read_table(parse_toml(text, where), FileFields, mistakes)
    mistakes.raise_if_any()
    if head is None or not head.tasks:
        raise InvalidValueError(f'{where} has no tasks; add a line such as tasks = ["PickXtimes"].')
    return head


def tasks_in(head: FileFields, where: str) -> Mapping[str, TaskScenarios]:
    """Return the words of each task that a file serves: commands, stated values, scenarios.

    A task for which the file has no commands gets those of its own file; so does each value for
    which the file has no words.

    Args:
        head: the content of the file.
        where: names it in messages.

    Raises:
        InvalidValueError: the file has mistakes; a line for each.
    """
    mistakes = Mistakes(where)
    mistakes.check_names("task", head.tasks, every_task())
    mistakes.check_names("task", [*head.commands, *head.stated], (*head.tasks, ALL))
    mistakes.raise_if_any()
    literals = read_literals(head.literal, head.tasks, mistakes)
    mistakes.raise_if_any()  # without its sentences a task would seem to lack commands
    words = {}
    for task in head.tasks:
        words[task] = _command_words(head, task, literals[task], mistakes)
    _check_stated(head, words, mistakes)
    _add_scenarios(head, words, mistakes)
    mistakes.raise_if_any()
    return words


def _check_stated(head: FileFields, words: Mapping[str, TaskScenarios], mistakes: Mistakes) -> None:
    """Add a mistake for each field that a file states and none of its tasks has."""
    for owner, texts in head.stated.items():
        known = words[owner].stated if owner in words else _all_stated(words)
        mistakes.at(f"stated.{owner}").check_names("field", texts, known)


def _add_scenarios(
    head: FileFields, words: Mapping[str, TaskScenarios], mistakes: Mistakes
) -> None:
    """Add each scenario of a file to the words of the tasks that it serves.

    A scenario, a text template, serves all tasks of the file, or those that it names.
    """
    for scenario in _read_scenarios(head, _all_stated(words), mistakes):
        served = scenario.fields.needs.tasks or head.tasks
        for task, task_words in words.items():
            if task in served:
                task_words.scenarios.append(scenario)


def _all_stated(words: Mapping[str, TaskScenarios]) -> dict[str, Text]:
    """Return the words that state each field in any of some tasks.

    ``{"color": <the {color} cube>}``; if several tasks state a field, those of the last one.
    """
    stated: dict[str, Text] = {}
    for task_words in words.values():
        stated |= task_words.stated
    return stated


def _entries_of_task(tables: Mapping[str, Any], task: str) -> dict[Any, Any]:
    """Return what a table of a file has for a task: entries for all tasks, then its own, which win.

    ``{"all": {"train": (…)}, "StopCube": {"test": (…)}}`` gives StopCube both. A list is for both
    pools: ``["Lift it."]`` becomes ``{"train": [...], "test": [...]}``.
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

    Commands and stated values that the file lacks are taken from the file that the task names for
    its words; `TaskScenarios.own` says which are the file's own.

    Args:
        head: the content of the file.
        task: its name.
        literals: the file's whole sentences of the task, by goal.
        mistakes: of the file.
    """
    path = _named_file(every_task().get(task))
    task_head = head
    if path is not None:
        task_head = read_head(read_text(path), path.name)

    own_stated = _entries_of_task(head.stated, task)
    stated = _stated_texts(_entries_of_task(task_head.stated, task), own_stated, mistakes)
    own_parts = list(own_stated)
    commands = _entries_of_task(task_head.commands, task)
    if ALL in head.commands or task in head.commands:
        commands = _entries_of_task(head.commands, task)
        own_parts.append(COMMANDS)
    # Whole sentences need no commands: a task without words of ours may have nothing else.
    if COMMANDS in own_parts or commands or not literals:
        _check_commands(commands, task, stated, mistakes)
    return TaskScenarios(commands, stated, [], mistakes.where, literals, own_parts)


def _stated_texts(
    usual: Mapping[str, str], own: Mapping[str, str], mistakes: Mistakes
) -> dict[str, Text]:
    """Return the words that state each field of a task: a file's own, or else the usual ones.

    ``{"color": <the {color} cube>}``. Words may have the slot of their own value and no other mark;
    a mistake is added for others.

    Args:
        usual: the words by field in the file that the task names.
        own: those of the file at hand.
        mistakes: of the file at hand.
    """
    stated = {}
    for name, usual_text in usual.items():
        part = mistakes.at(f"stated {name}")
        text = _parse_or_report(own.get(name, usual_text), part)
        slot = "amounts" if name == AMOUNT_FIELD else name
        other_slots = set(slots_in(text)) - {slot}  # it may say its own value only
        if other_slots or any(pointers_in(text)):
            part.add(f"has other marks than those of {{{slot}}}")
        stated[name] = text
    return stated


def _check_commands(
    commands: Mapping[PoolName, Texts], task: str, stated: Collection[str], mistakes: Mistakes
) -> None:
    """Add a mistake for each pool without commands, and for each command with wrong marks.

    A command may only have slots for values that are stated: ``Pick up {color}.``

    Args:
        commands: of the task, by pool.
        task: its name.
        stated: the fields for whose values there are words.
        mistakes: of the file.
    """
    part = mistakes.at(f"commands of {task}")
    for pool in POOLS:
        texts = commands.get(pool, ())
        if not texts:
            mistakes.add(f"has no commands of {task} in the pool {pool}")
        for text in texts:
            _check_command(text, stated, part)


def _check_command(text: str, stated: Collection[str], mistakes: Mistakes) -> None:
    """Add a mistake if a command has other marks than slots for values that are stated."""
    for mark in _parse_or_report(text, mistakes):
        is_plain = isinstance(mark, TaggedText)
        is_value = isinstance(mark, Slot) and mark.form is None and mark.name in stated
        if not is_plain and not is_value:
            names = " and ".join(f"{{{name}}}" for name in stated)
            mistakes.add(f"has other marks than {names}: {excerpt(text)}")


def _read_scenarios(
    head: FileFields, stated: Collection[str], mistakes: Mistakes
) -> Iterator[Scenario]:
    """Yield the scenarios of a file whose fields are right; add a mistake for each other one.

    The frame, the name of a scenario, may be there once for each setting and pool.

    Args:
        head: the content of the file.
        stated: the fields for whose values there are words.
        mistakes: of the file.
    """
    settings_by_frame: dict[str, set[str]] = {}  # by frame: the settings with pools that have it
    # In files of users, which have a name, a scenario without a pool is for both.
    default_fields: dict[str, Any] = {"pool": None} if head.name else {}
    for number, table in enumerate(head.scenario, 1):
        part = mistakes.at(f"scenario {excerpt(table.get('frame', number))}")
        scenario = _read_scenario(default_fields | table, stated, part)
        if scenario is None:
            continue
        part.at("needs.tasks").check_names("task", scenario.fields.needs.tasks, head.tasks)
        settings_before = settings_by_frame.setdefault(scenario.fields.frame, set())
        settings = _settings_of(scenario)
        if settings & settings_before:
            part.add(f"stands twice in the setting {min(settings & settings_before)}")
        settings_before |= settings  # in place, in the dictionary
        yield scenario


def _settings_of(scenario: Scenario) -> set[str]:
    """Return the setting of a scenario with each of its pools of words: ``{"direct, train"}``."""
    fields = scenario.fields
    pools = POOLS if fields.pool is None else (fields.pool,)
    return {f"{fields.setting}, {pool}" for pool in pools}


def _read_scenario(
    table: Mapping[str, Any], stated: Collection[str], mistakes: Mistakes
) -> Scenario | None:
    """Return the scenario that a table of the file holds; None if a field has a mistake.

    Each mistake is added. What fields need of each other is checked once each of them is right.

    Args:
        table: of the scenario, as written.
        stated: the fields for whose values there are words.
        mistakes: of the file, at the scenario.
    """
    flat_table = _with_full_names(table)
    fields = read_table(flat_table, ScenarioFields, mistakes, sentence_names(stated))
    texts = _read_sentences(flat_table, fields, stated, mistakes)
    if fields is None:
        return None
    _check_names(fields, mistakes.at("frame or people"))
    said = tuple(name for name in sorted(stated) if f"say.{name}" in texts)
    scenario = Scenario(fields, texts, _people_of(fields, texts), said)
    check_needs(scenario, stated, mistakes)
    return scenario


def _check_names(fields: ScenarioFields, mistakes: Mistakes) -> None:
    """Add a mistake if a scenario's frame (its name), or a person's name, has a bracket."""
    _parse_or_report(fields.frame, mistakes)
    for names in (fields.people or {}).values():
        for name in names:
            _parse_or_report(name, mistakes)


def _with_full_names(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's table with its sentences by full name.

    ``{"say": {"color": [...]}}``, as TOML has ``say.color``, becomes ``{"say.color": [...]}``.
    """
    flat: dict[str, Any] = {}
    for name, value in table.items():
        if name in ScenarioFields.__struct_fields__:
            flat[name] = value
        else:
            flat.update(_full_names(value, name))
    return flat


def _read_sentences(
    flat: Mapping[str, Any],
    fields: ScenarioFields | None,
    stated: Collection[str],
    mistakes: Mistakes,
) -> Sentences:
    """Return the sentences of a scenario, parsed, by field, such as ``say.color``.

    Args:
        flat: the scenario's table with full names.
        fields: the other fields; None if one of them is wrong.
        stated: the fields for whose values there are words.
        mistakes: of the file, at the scenario; those of sentences are added.
    """
    reader = _SentenceReader(str(flat.get("list", "")), _operations(fields), _known_slots(stated))
    texts: dict[str, tuple[Text, ...]] = {}
    names = sentence_names(stated)
    for name, value in flat.items():
        if name in names:
            part = mistakes.at(name)
            texts[name] = tuple(reader.read(text, part) for text in _alternatives(name, value))
    return texts


def _alternatives(name: str, value: object) -> list[Any]:
    """Return the sentences of a field, as written: the alternatives, or the only one."""
    if isinstance(value, list) and name.startswith(_FIELDS_WITH_ALTERNATIVES):
        return value
    return [value]


def _operations(fields: ScenarioFields | None) -> set[str]:
    """Return the operations for which the relations of a scenario stand: ``minus`` for *one fewer*.

    Empty for scenarios that compute nothing, or whose fields are wrong (None).
    """
    operations: set[str] = set()
    if fields is not None and fields.derive is not None:
        for name in fields.derive.relations:
            if name in EVERY_RELATION:
                operations.add(EVERY_RELATION[name].operation)
    return operations


def _people_of(fields: ScenarioFields, texts: Sentences) -> tuple[Texts, ...]:
    """Return the people of whom a scenario can speak, with pronouns; empty if it names none.

    ``("Leo", "he", "him", "his", "his")`` is one, in the order of `PERSON`.
    """
    slots: set[str] = set()
    for alternatives in texts.values():
        for text in alternatives:
            slots.update(slots_in(text))
    if PEOPLE.isdisjoint(slots):
        return ()
    people = []
    for pronoun, names in (fields.people or general().people).items():
        for name in names:
            people.append((name, *PRONOUNS[pronoun]))
    return tuple(people)


def _known_slots(stated: Collection[str]) -> frozenset[str]:
    """Return all slots that sentences may have: ``color``, ``rival color``, ``person`` ….

    `stated` has the fields for whose values there are words.
    """
    slots = slots_of(stated)
    rivals = {f"rival {name}" for name in slots if name.isalpha() and name != AMOUNT_FIELD}
    return OTHER_SLOTS | slots | rivals


@functools.cache
def _pattern_of_row(words: str) -> re.Pattern[str]:
    """Return a pattern for the words of a row of the table of pointers, with any noun for ``*``.

    ``that * cube`` matches *that red cube*; ``**`` is any words.
    """
    any_words = "[A-Za-z{}' ]+"
    any_noun = "[a-z]+"
    pattern = re.escape(words).replace(r"\*\*", any_words).replace(r"\*", any_noun)
    return re.compile(pattern)


def _row_matches(row: PointerRow, words: str, sentence: str) -> bool:
    """Return whether a row of the table of pointers is for the words of a pointer.

    The row *the latter* is for these words alone. The words of a row may also stand in others, ``of
    <those>``: then the sentence must have these as well.

    Args:
        row: of the table.
        words: of the pointer, the words that point back.
        sentence: in which they stand, with ``<those>`` for pointers.
    """
    if "<" in row.words:
        return f"<{words}>" in row.words and _pattern_of_row(row.words).search(sentence) is not None
    return _pattern_of_row(row.words).fullmatch(words) is not None


@dataclass(frozen=True)
class _SentenceReader:
    """Reads the sentences of one scenario.

    Attributes:
        listed: the slot of which the scenario lists values; empty if it lists none.
        operations: those of the relations that it can say; they decide what *that one* means.
        slots: that its sentences may have.
    """

    listed: str
    operations: Collection[str]
    slots: Collection[str]

    def read(self, text: object, mistakes: Mistakes) -> Text:
        """Return the parts of a sentence, each pointer with the operation that its words stand for.

        Pointers are words that point back; the table of pointers has their operations. Mistakes are
        added: unknown slots, and pointers that are not in the table.
        """
        parts = _parse_or_report(text, mistakes)
        mistakes.check_names("slot", slots_in(parts), self.slots)
        parts_read: list[Part] = []
        for part in parts:
            if isinstance(part, Pointer):
                parts_read.append(self._with_operation(part, str(text), mistakes))
            else:
                parts_read.append(part)
        return tuple(parts_read)

    def _with_operation(self, pointer: Pointer, sentence: str, mistakes: Mistakes) -> Pointer:
        """Return a pointer, words that point back, with what its row in the table of pointers says.

        *the latter* gets the operation ``rank``. Of rows for the same words, such as *that one*,
        that of the scenario's relations is taken: *one earlier* or *one later*. Without a row of
        its class, the pointer stays as it is, and a mistake is added.

        Args:
            pointer: to look up.
            sentence: that has it, as written.
            mistakes: of the file, at the sentence.
        """
        kind = type_of(pointer.of, self.listed)
        # As the table has it, without class and slot: "<it color: it>" becomes "<it>".
        said = re.sub(r"<[^:<>]+: ", "<", sentence)
        rows = [row for row in _rows_of(kind) if _row_matches(row, pointer.words, said)]
        # Rows with the words around them come first, then those of the relations.
        rows.sort(key=lambda row: ("<" not in row.words, row.operation not in self.operations))
        for row in rows:
            if row.kind == pointer.expression:
                return pointer._replace(resolved=parse(row.resolved), operation=row.operation)
        mistakes.add(_wrong_pointer(pointer, sentence, kind, rows))
        return pointer


def _rows_of(kind: str) -> list[PointerRow]:
    """Return the rows of the table that point back at a type of value, ``number``."""
    return [row for row in pointer_table() if kind in row.of]


def _wrong_pointer(pointer: Pointer, sentence: str, kind: str, rows: Sequence[PointerRow]) -> str:
    """Return the mistake about a pointer whose words have another class, or are not in the table.

    Args:
        pointer: the words that point back, as written.
        sentence: that has it.
        kind: the type of what it stands for.
        rows: those of the table for its words, of other classes.
    """
    found = f"has the pointer <{pointer.expression} {pointer.of}: {pointer.words}>"
    if rows:
        classes = " or ".join(dict.fromkeys(repr(row.kind) for row in rows))
        return f"{found}; in pointers.toml these words have the class {classes} for a {kind}"
    import difflib  # here, because only a mistake needs it

    known = {_row_as_written(row, pointer.of) for row in _rows_of(kind)}
    nearest = difflib.get_close_matches(sentence, known, n=5, cutoff=0)
    return (
        f"{found}, which does not exist; the nearest for a {kind}: "
        f"{'; '.join(nearest) or 'none'} (* is any noun); docs/scenario-marks.md has all"
    )


def _row_as_written(row: PointerRow, of: str) -> str:
    """Return a row of the table of pointers as authors write it: ``<latter color: the latter>``.

    Args:
        row: of the table.
        of: the slot that the words stand for.
    """
    begun = f"<{row.kind} {of}: "
    if "<" in row.words:
        return row.words.replace("<", begun)
    return f"{begun}{row.words}>"


def type_of(name: str, listed: str = "") -> str:
    """Return the type of the value that a slot holds, as the table of pointers names it.

    ``repeats`` gives ``number``, ``visit`` gives ``visit``, and ``list``, all values together,
    ``pair``. One value of a list, ``list.0`` or ``taken``, has the type of the slot that is listed.

    Args:
        name: of the slot.
        listed: the slot of the goal of which the scenario lists values; empty if it lists none.
    """
    base, _, number = name.partition(".")
    if not number and base == "list":
        return "pair"
    if not number and base == "colors":
        return "colors"
    if base in ("list", "taken"):
        base = listed or "color"
    return SLOT_TYPE_NAMES.get(base, base)


def _full_names(value: object, name: str) -> Iterator[tuple[str, object]]:
    """Yield the entries of a nested table by full name: ``say.color`` for ``color`` in ``say``.

    Keys may hold dots themselves: ``colors.0`` is one. A value that is no table is yielded under
    `name`.
    """
    if not isinstance(value, dict) or not value:
        yield name, value
        return
    for key, inner in value.items():
        yield from _full_names(inner, f"{name}.{key}")


def _parse_or_report(text: object, mistakes: Mistakes) -> Text:
    """Return the parts of a sentence; of one with a mistake, which is added, only an excerpt."""
    try:
        return parse(text)
    except ValueError as error:
        mistakes.add(str(error))
        return (TaggedText(excerpt(text)),)
