"""Files of answers: JSON lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from roboirg.apps.grounding.items.grounding_item import (
    GroundingItem,
    QuestionKind,
    decode_lines,
    read_content,
)
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import clip_text
from roboirg.util.atomic_write import write_atomically

_MAX_QUOTE = 60


class Answer(msgspec.Struct, frozen=True):
    """One answer; a line of JSON has its fields.

    Attributes:
        id: of the item.
        kind: of the question.
        reply: what was answered, as text.
    """

    id: str
    kind: QuestionKind
    reply: str


def read_answers(path: Path, items: Sequence[GroundingItem]) -> list[Answer]:
    """Read a model's answers to grounding questions from a file of JSON lines.

    Args:
        path: of the file; each line has the id of an item, the kind of question, and the reply.
        items: of the dataset that the answers are for.

    Raises:
        InvalidValueError: the file cannot be read, a line is no answer, names an unknown item, or
            answers a question again.
    """
    known = {item.id for item in items}
    answers = {}
    content = read_content(path, f"Answers {str(path)!r} cannot be read")
    for number, answer in decode_lines(content, Answer, path):
        question = answer.id, answer.kind
        if answer.id not in known:
            name = clip_text(answer.id, _MAX_QUOTE)
            raise InvalidValueError(
                f"{path}, line {number}: the dataset has no item {name!r}; are these answers to "
                "another dataset?"
            )
        if question in answers:
            raise InvalidValueError(
                f"{path}, line {number}: {answer.kind} of item {answer.id!r} occurs again."
            )
        answers[question] = answer
    if not answers:
        raise InvalidValueError(f"Answers {str(path)!r}: the file holds no answers.")
    return list(answers.values())


def write_answers(path: Path, answers: Iterable[Answer]) -> None:
    """Write answers as JSON lines."""
    write_atomically(path, msgspec.json.Encoder().encode_lines(answers))
