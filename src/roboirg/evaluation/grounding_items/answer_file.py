"""Files of answers, as JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import clip_text
from roboirg.evaluation.grounding_items.grounding_item import (
    QUESTION_KINDS,
    GroundingItem,
    QuestionKind,
)
from roboirg.util.atomic_write import write_atomically

_MAX_QUOTE = 60
_FIELDS: dict[str, QuestionKind] = {"answer": "slots", "choice": "choice", "points": "points"}


class Answer(NamedTuple):
    """One answer.

    Attributes:
        id: of the item.
        kind: of the question.
        reply: what was answered, as text.
    """

    id: str
    kind: QuestionKind
    reply: str


def read_answers(path: Path, items: Sequence[GroundingItem]) -> list[Answer]:
    """Return the answers of a file, each for a question of the items.

    A line of JSON has the ``id`` of an item and any of ``answer`` (an object of slots, or its
    text), ``choice`` (a letter) and ``points`` (a list of objects with x and y); or a ``reply``,
    the model's text, and the ``kind`` of question, by default slots.

    Raises:
        InvalidValueError: the file cannot be read, a line is none of these, names an unknown item,
            or answers a question again.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidValueError(f"Answers {str(path)!r} cannot be read ({error}).") from error
    known, seen = {item.id for item in items}, set()
    answers = []
    for number, answer in _json_answers(text):
        place = f"{path}, line {number}"
        if isinstance(answer, str):
            raise InvalidValueError(f"{place}: {answer}")
        if answer.id not in known:
            raise InvalidValueError(
                f"{place}: the dataset has no item {clip_text(answer.id, _MAX_QUOTE)!r}; are "
                "these answers to another dataset?"
            )
        if answer[:2] in seen:
            raise InvalidValueError(f"{place}: {answer.kind} of item {answer.id!r} occurs again.")
        seen.add(answer[:2])
        answers.append(answer)
    if not answers:
        raise InvalidValueError(f"Answers {str(path)!r}: the file holds no answers.")
    return answers


def write_answers(path: Path, answers: Iterable[Answer]) -> None:
    """Write answers as JSON lines."""
    lines = (
        json.dumps({"id": one.id, "kind": one.kind, "reply": one.reply}) + "\n" for one in answers
    )
    write_atomically(path, "".join(lines))


def _json_answers(text: str) -> Iterator[tuple[int, Answer | str]]:
    """Yield number and answers of each line; in place of an answer, what is wrong."""
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError) as error:
            yield number, f"not JSON ({error})."
            continue
        for answer in _answers_of(row):
            yield number, answer


def _answers_of(row: Any) -> Iterator[Answer | str]:  # noqa: ANN401 - whatever JSON holds
    if not isinstance(row, dict) or not isinstance(row.get("id"), str):
        yield 'an answer is an object with the "id" of an item.'
        return
    name, kind = row["id"], row.get("kind", "slots")
    if kind not in QUESTION_KINDS:
        kinds = ", ".join(QUESTION_KINDS)
        yield f"kind is {clip_text(repr(kind), _MAX_QUOTE)}; it must be one of {kinds}."
    elif "reply" in row:
        reply = row["reply"]
        yield Answer(name, kind, reply if isinstance(reply, str) else "")
    elif not _FIELDS.keys() & row.keys():
        yield f"item {name!r} has no reply and none of {', '.join(_FIELDS)}."
    for field in _FIELDS.keys() & row.keys() if "reply" not in row else ():
        yield Answer(name, _FIELDS[field], _as_reply(field, row[field]))


def _as_reply(field: str, value: Any) -> str:  # noqa: ANN401 - whatever JSON holds
    if field == "choice" or isinstance(value, str):
        return value if isinstance(value, str) else ""
    return json.dumps({"points": value} if field == "points" else value)
