"""Write wordings as a wording file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from roboirg.core.episode import SlotValue
from roboirg.language.worded_command import StatedPhrase, TaskWordings, WordedCommand

Tables = Mapping[str, Mapping[str, StatedPhrase]]
_BARE = frozenset("abcdefghijklmnopqrstuvwxyz0123456789")


def wording_text(name: str, source: str, tasks: Mapping[str, TaskWordings]) -> str:
    lines = [f"name = {_quoted(name)}", f"source = {_quoted(source)}"]
    for task, wordings in tasks.items():
        lines += ["", *_task_lines(task, wordings)]
    return "\n".join(lines) + "\n"


def _task_lines(task: str, wordings: TaskWordings) -> Iterator[str]:
    shared = _shared(wordings.commands)
    yield f"[{task}]"
    if wordings.own:
        yield f"own = [{', '.join(map(_quoted, sorted(wordings.own)))}]"
    yield from _phrase_lines(f"{task}.phrases", shared)
    for command in wordings.commands:
        yield ""
        yield f"[[{task}.commands]]"
        if command.when:
            conditions = (f"{slot} = {_value(value)}" for slot, value in command.when.items())
            yield f"when = {{ {', '.join(conditions)} }}"
        if command.pointed:
            yield f"pointed = [{', '.join(map(_quoted, sorted(command.pointed)))}]"
        yield f"text = {_quoted(command.text)}"
        rivaled = any(_both_may_fit(command, one) for one in wordings.commands)
        special = {
            field: table
            for field in command.fields
            if (table := command.phrases[field]).items() - shared[_base(field)].items()
            # With phrases of others, it would also fit goals that are for its rivals.
            or (rivaled and table != shared[_base(field)])
        }
        yield from _phrase_lines(f"{task}.commands.phrases", special)


def _phrase_lines(where: str, tables: Tables) -> Iterator[str]:
    for field, table in tables.items():
        yield ""
        yield f"[{where}.{_key(field)}]"
        for value, phrase in table.items():
            yield f"{_key(value)} = {_quoted(_marked(phrase))}"


def _shared(commands: tuple[WordedCommand, ...]) -> dict[str, dict[str, StatedPhrase]]:
    """Return the phrases that the commands have in common, under the fields without numbers."""
    shared: dict[str, dict[str, StatedPhrase]] = {}
    for command in commands:
        for field in command.fields:
            table, known = command.phrases[field], shared.setdefault(_base(field), {})
            if all(known.get(value, phrase) == phrase for value, phrase in table.items()):
                known.update(table)
    return {base: dict(sorted(table.items())) for base, table in shared.items()}


def _both_may_fit(first: WordedCommand, second: WordedCommand) -> bool:
    """Return whether two templates are told apart by their phrases only."""
    if first is second or set(first.fields) != set(second.fields):
        return False
    return all(second.when.get(slot, value) == value for slot, value in first.when.items())


def _base(field: str) -> str:
    return field.partition(".")[0]


def _marked(phrase: StatedPhrase) -> str:
    core = f"[{phrase.core}]" if phrase.before or phrase.after else phrase.core
    return f"{phrase.before}{core}{phrase.after}"


def _value(value: SlotValue) -> str:
    return json.dumps(list(value) if isinstance(value, tuple) else value)


def _key(key: str) -> str:
    return key if set(key) <= _BARE else _quoted(key)


def _quoted(text: str) -> str:
    # A JSON string is a TOML string.
    return json.dumps(text, ensure_ascii=False)
