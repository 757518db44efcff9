"""A wording file: words of a user's own. `docs/wording-files.md` explains it to authors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.language.scenarios.robomme_sentences import check_robomme_name
from roboirg.language.scenarios.scenario import FileFields, TaskScenarios
from roboirg.language.scenarios.scenario_file import ALL, read_head, tasks_in
from roboirg.language.scenarios.written import text_of
from roboirg.util.short_hash import short_hash

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


class Wordings(NamedTuple):
    """The content of a wording file.

    Attributes:
        name: of the wordings.
        fingerprint: of the file's content.
        tasks: the words of each task; settings without scenarios have ours.
        needs_language_4: whether there are commands or scenarios.
    """

    name: str
    fingerprint: str
    tasks: Mapping[str, TaskScenarios]
    needs_language_4: bool

    @property
    def identity(self) -> str:
        """Name and fingerprint, as in records."""
        return f"{self.name}@{self.fingerprint}"


def read_wordings(path: str | Path) -> Wordings:
    """Read a wording file."""
    return parse_wordings(text_of(Path(path)), str(path))


def parse_wordings(text: str, where: str) -> Wordings:
    """Return the content of a wording file; `where` names it in messages."""
    head = read_head(text, where)
    check_name(head.name, where)
    return _wordings(head, text, where)


def read_words(path: Path) -> Wordings:
    """Return the content of a wording file, or of a file like ours, which has no name."""
    text, where = text_of(path), path.name
    head = read_head(text, where)
    if head.name:
        check_name(head.name, where)
    return _wordings(head, text, where)


def _wordings(head: FileFields, text: str, where: str) -> Wordings:
    tasks = tasks_in(head, where)
    for task, words in tasks.items():
        has_commands = {ALL, task} & {*head.commands, *head.stated}
        if not (words.scenarios or words.literals or has_commands):
            raise InvalidValueError(f"{where} has no words of {task}, which stands in its tasks.")
        check_robomme_name(head.name, task, words.literals, where)
    is_spoken = bool(head.scenario or head.commands or head.stated)
    return Wordings(head.name, short_hash(text)[:8], tasks, is_spoken)


def check_name(name: str, where: str) -> None:
    """Check that a name can be one of wordings."""
    if not _NAME.fullmatch(name):
        raise InvalidValueError(
            f"{where} has the name {name!r}; it must begin with a line such as "
            "name = \"mine\", a word of letters, digits, '-' and '_'."
        )
