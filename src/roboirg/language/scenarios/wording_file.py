"""A wording file: words of a user's own. `docs/wording-files.md` explains it to authors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.language.scenarios.robomme_sentences import check_robomme_name
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.scenario_file import read_head, tasks_in
from roboirg.language.scenarios.written import shown, text_of
from roboirg.util.short_hash import short_hash

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


class Wordings(NamedTuple):
    """The content of a wording file.

    Attributes:
        name: of the wordings.
        fingerprint: of the file's content.
        tasks: the words of each task; settings without scenarios have ours.
    """

    name: str
    fingerprint: str
    tasks: Mapping[str, TaskScenarios]

    @property
    def identity(self) -> str:
        """Name and fingerprint, as in records."""
        return f"{self.name}@{self.fingerprint}"


def read_wordings(path: str | Path) -> Wordings:
    """Read a wording file."""
    return parse_wordings(text_of(Path(path)), str(path))


def read_words(path: Path) -> Wordings:
    """Read a wording file, or a file like ours, which has no name."""
    return parse_wordings(text_of(path), path.name, needs_name=False)


def parse_wordings(text: str, where: str, *, needs_name: bool = True) -> Wordings:
    """Return the content of a wording file: words of its tasks under its name and a hash.

    `where` names the file in messages. Raises InvalidValueError for an invalid file, or one without
    words of a task that it lists.
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
    """Check that a name can be one of wordings."""
    if not _NAME.fullmatch(name):
        raise InvalidValueError(
            f"{where} has the name {shown(name)}; it must begin with a line such as "
            "name = \"mine\", a word of letters, digits, '-' and '_'."
        )
