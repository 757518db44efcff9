"""Wording files: read them, and check them.

`docs/wording-files.md` explains the format.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from roboirg.core.episode import SlotValue
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.language.settings import all_settings
from roboirg.language.worded_command import (
    FIELD,
    StatedPhrase,
    TaskWordings,
    WordedCommand,
    Wordings,
)
from roboirg.language.wordings.robomme_sentences import check_robomme_name
from roboirg.tasks import every_task
from roboirg.util.regular_file import read_regular
from roboirg.util.short_hash import short_hash

FIELDS: tuple[str, ...] = (
    "color", "repeats", "visit", "placement", "relation", "colors.0", "colors.1",
    "cubes.0", "cubes.1", "cubes.2",
)  # fmt: skip
"""The fields that a command may have."""
SLOTS: Mapping[str, tuple[type, bool]] = {
    "color": (str, False), "colors": (str, True), "counts": (int, True), "repeats": (int, False),
    "visit": (int, False), "placement": (int, False), "relation": (str, False),
}  # fmt: skip
"""The slots that a condition may have: the type of their values, and whether it is a list."""
MOST_BYTES = 4_000_000
"""Of a wording file; the largest that was seen has 30,000."""
_MOST_KEY_PARTS = 20
_KEY_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![\w-]){_KEY_PART}(?:{_KEY_PART}){{{_MOST_KEY_PARTS}}}")
MOST_LETTERS = 2_000
"""Of a command or phrase."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_PHRASE = re.compile(r"([^\[\]{}]*)\[([^\[\]{}]+)\]([^\[\]{}]*)|([^\[\]{}]+)")

_ARTICLE = re.compile(r"\b(?:the|an?) $", re.IGNORECASE)


def read_wordings(path: str | Path) -> Wordings:
    """Read a wording file."""
    try:
        text = read_regular(Path(path), MOST_BYTES).decode()
    except (OSError, ValueError) as error:  # a path may hold NUL
        reason = str(error).rstrip(".")
        message = f"The wording file {str(path)!r} cannot be read: {reason}."
        raise InvalidValueError(message) from error
    where = f"wording file {str(path)!r}"
    wordings = parse_wordings(text, where)
    check_robomme_name(wordings, where)
    return wordings


def parse_wordings(text: str, where: str) -> Wordings:
    """Return the content of a wording file; `where` names it in messages."""
    try:
        data = _parse_toml(text)
    except (ValueError, RecursionError) as error:
        raise InvalidValueError(f"The {where} is not valid TOML: {error}.") from error
    name, source = data.pop("name", None), data.pop("source", "")
    name = check_name(name, where)
    if not isinstance(source, str):
        raise InvalidValueError(f"The {where} has the source {source!r}; it must be a text.")
    check_names(f"task (in the {where})", data, every_task())
    tasks = {task: _TaskReader(where, task).read(content) for task, content in data.items()}
    if not tasks:
        raise InvalidValueError(f"The {where} has no task; add one such as [PickXtimes].")
    return Wordings(name, short_hash(text)[:8], tasks, source)


def _parse_toml(text: str) -> dict[str, Any]:
    if _DEEP_KEY.search(text):  # takes a time and memory that grow with the square of the depth
        raise ValueError(f"a key has more than {_MOST_KEY_PARTS} parts")
    return tomllib.loads(text)


def check_name(name: object, where: str) -> str:
    """Return the name of wordings if it can be one."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InvalidValueError(
            f"The {where} has the name {name!r}; it must begin with a line such as "
            "name = \"robomme\", a word of letters, digits, '-' and '_'."
        )
    return name


class _TaskReader:
    """Reads the table of one task; its complaints name file and task."""

    def __init__(self, where: str, task: str) -> None:
        self._where = f"{task} in the {where}"

    def read(self, content: object) -> TaskWordings:
        """Return the commands of the task."""
        table = self._table(content, "the task", ("own", "phrases", "commands"))
        own, commands = table.get("own", []), table.get("commands", [])
        if not isinstance(own, list) or not isinstance(commands, list) or not commands:
            self._fail("needs [[TASK.commands]], and own, if given, must be a list")
        implicit = [name for name, rule in all_settings().items() if rule.implicit]
        check_names(f"implicit setting ({self._where})", own, implicit)
        shared = self._phrases(table.get("phrases", {}))
        return TaskWordings(tuple(self._command(one, shared) for one in commands), frozenset(own))

    def _command(
        self, content: object, shared: Mapping[str, Mapping[str, StatedPhrase]]
    ) -> WordedCommand:
        table = self._table(content, "a command", ("text", "when", "phrases", "pointed"))
        text = table.get("text")
        if not isinstance(text, str) or not text.strip():
            self._fail(f"has a command with the text {text!r}; it must be a sentence")
        self._check_printable(text)
        if set("{}[]") & set(FIELD.sub("", text)):
            self._fail(f"has a bracket that is not a field in the command {text!r}")
        when = {slot: self._condition(slot, value) for slot, value in
                self._table(table.get("when", {}), "when", list(SLOTS)).items()}  # fmt: skip
        phrases = {**shared, **self._phrases(table.get("phrases", {}))}
        names = FIELD.findall(text)
        for at, name in enumerate(names):
            check_names(f"field ({self._where})", [name], FIELDS)
            if name in names[:at]:
                self._fail(f"has the field {{{name}}} twice in the command {text!r}")
            if name not in phrases and name.partition(".")[0] not in phrases:
                self._fail(f"has no phrases for the field {{{name}}} of the command {text!r}")
        return WordedCommand(text, when, phrases, self._pointed(table.get("pointed", []), names))

    def _pointed(self, content: object, names: list[str]) -> frozenset[str]:
        if not isinstance(content, list) or not all(isinstance(one, str) for one in content):
            self._fail(f"has pointed = {content!r}; it must be a list of fields of the command")
        check_names(f"field in pointed ({self._where})", content, names)
        return frozenset(content)

    def _condition(self, slot: str, value: object) -> SlotValue:
        kind, several = SLOTS[slot]
        values: list[Any] = value if several and isinstance(value, list) else [value]
        if several != isinstance(value, list) or any(type(one) is not kind for one in values):
            noun = "word" if kind is str else "number"
            wanted = f"a list of {noun}s" if several else f"a {noun}"
            self._fail(f"has the condition {slot} = {value!r}; it must be {wanted}")
        return tuple(values) if several else values[0]

    def _phrases(self, content: object) -> dict[str, dict[str, StatedPhrase]]:
        names = {name for field in FIELDS for name in (field, field.partition(".")[0])}
        tables = self._table(content, "phrases", sorted(names))
        return {name: self._phrase_table(name, table) for name, table in tables.items()}

    def _phrase_table(self, name: str, content: object) -> dict[str, StatedPhrase]:
        if not isinstance(content, dict):
            self._fail(f"has the phrases {name} = {content!r}; they must be a table of values")
        return {value: self._phrase(name, value, text) for value, text in content.items()}

    def _phrase(self, name: str, value: str, text: object) -> StatedPhrase:
        found = _PHRASE.fullmatch(text) if isinstance(text, str) else None
        core = "" if found is None else found[2] or found[4]
        if found is None or not core.strip():
            self._fail(f"has the phrase {text!r} for {name} {value}; it must be words, with at "
                       "most one part in [brackets]")  # fmt: skip
        if name.partition(".")[0] != "cubes" and _ARTICLE.search(found[1] or ""):
            self._fail(f"has the phrase {text!r} for {name} {value}; the brackets must hold a "
                       "whole phrase with its article, such as [the red cube]")  # fmt: skip
        self._check_printable(found[0])
        return StatedPhrase(found[1] or "", core, found[3] or "")

    def _check_printable(self, text: str) -> None:
        if len(text) > MOST_LETTERS:
            self._fail(f"has words of {len(text):,} characters, {text[:40]!r}…; at most "
                       f"{MOST_LETTERS:,} are one instruction")  # fmt: skip
        if not (text.isascii() and text.isprintable()):
            self._fail(f"has the words {text!r}; they must be printable ASCII on one line, as all "
                       "instructions are")  # fmt: skip

    def _table(
        self, content: object, what: str, known: tuple[str, ...] | list[str]
    ) -> dict[str, object]:
        if not isinstance(content, dict):
            self._fail(f"has {content!r} for {what}; it must be a table")
        check_names(f"key of {what} ({self._where})", content, known)
        return content

    def _fail(self, complaint: str) -> NoReturn:
        raise InvalidValueError(f"{self._where} {complaint}.")
