"""A wording file: words of a user's own. `docs/add-scenario.md` explains it to authors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.language.scenarios.robomme_sentences import check_robomme_name
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.scenario_file import read_head, tasks_in
from roboirg.language.scenarios.written import excerpt, read_text
from roboirg.util.short_hash import short_hash

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


class Wordings(NamedTuple):
    """The content of a wording file, checked.

    Attributes:
        name: of the wordings, ``mine``; empty for a file like ours.
        fingerprint: the first 8 digits of a hash of the file's text.
        tasks: the words of each task; settings without scenarios have ours.
    """

    name: str
    fingerprint: str
    tasks: Mapping[str, TaskScenarios]

    @property
    def identity(self) -> str:
        """Name and fingerprint, as in records: ``mine@1a2b3c4d``."""
        return f"{self.name}@{self.fingerprint}"


def read_wordings(path: str | Path) -> Wordings:
    """Read a wording file; it must have a name.

    Raises:
        InvalidValueError: it cannot be read or is invalid, with a line for each mistake.
    """
    return parse_wordings(read_text(Path(path)), str(path))


def read_words(path: Path) -> Wordings:
    """Read a wording file, or a file like ours, which has no name.

    Raises:
        InvalidValueError: it cannot be read or is invalid, with a line for each mistake.
    """
    return parse_wordings(read_text(path), path.name, needs_name=False)


def parse_wordings(text: str, where: str, *, needs_name: bool = True) -> Wordings:
    """Return the content of a wording file: the words of its tasks under its name and a hash.

    Args:
        text: of the file, TOML.
        where: names the file in messages.
        needs_name: whether it must have a name; files like ours have none.

    Raises:
        InvalidValueError: the file is invalid, or without words of a task that it lists.
    """
    head = read_head(text, where)
    if head.name or needs_name:
        check_name(head.name, where)
    tasks = tasks_in(head, where)
    for task, words in tasks.items():
        if not (words.scenarios or words.literals or words.own):
            raise InvalidValueError(f"{where} has no words of {task}, which stands in its tasks.")
        check_robomme_name(head.name, task, words.literals, where)
    return Wordings(head.name, short_hash(text)[:8], tasks)


def check_name(name: str, where: str) -> None:
    """Check that wordings can have a name: a letter, then letters, digits, ``-`` and ``_``.

    Raises:
        InvalidValueError: they cannot; `where` names the file.
    """
    if not _NAME.fullmatch(name):
        raise InvalidValueError(
            f"{where} has the name {excerpt(name)}; it must begin with a line such as "
            "name = \"mine\", a word of letters, digits, '-' and '_'."
        )
