"""Whole sentences for single goals, such as RoboMME's: read them, and say them.

They serve the explicit setting, in every version of our words.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import msgspec

from roboirg.core.episode import Goal, SlotValue, describe_goal
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.plain_text import clip_text
from roboirg.language.instruction import Meaning
from roboirg.language.phrases import TaggedText, plain
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.scenarios.markup import parse
from roboirg.language.scenarios.written import converted
from roboirg.language.settings import EXPLICIT, all_settings
from roboirg.language.settings.setting import Setting
from roboirg.tasks.splits.splits import get_episode

Literals = Mapping[Goal, str]
"""The sentence of each goal."""


class LiteralFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A sentence as it was written.

    Attributes:
        task: whose goal it states.
        when: the goal, a value for each of its slots.
        text: the sentence.
    """

    task: str
    when: Mapping[str, Any]
    text: str


def read_literals(
    written: Iterable[object], tasks: Sequence[str], where: str, mistakes: list[str]
) -> dict[str, dict[Goal, str]]:
    """Return the sentences of each task; what is wrong with one is added to the mistakes."""
    found: dict[str, dict[Goal, str]] = {task: {} for task in tasks}
    for number, one in enumerate(written, 1):
        at = f"{where}, literal {number}"
        try:
            literal = converted(one, LiteralFields, at)
            check_names(f"task of {at}, named", [literal.task], tasks)
            goal, sentence = _goal(literal, at), _sentence(literal.text, at)
        except InvalidValueError as error:
            mistakes.append(str(error))
            continue
        if goal in found[literal.task]:
            mistakes.append(f"{at} states the goal {_in_words(goal)} of {literal.task} again.")
        found[literal.task][goal] = sentence
    return found


def _goal(literal: LiteralFields, where: str) -> Goal:
    """Return the goal that a sentence is for."""
    slots = _example(literal.task).as_mapping()
    if literal.when.keys() != slots.keys():
        given = clip_text(repr(dict(literal.when)), 80)
        raise InvalidValueError(
            f"{where} has when = {given}; it must have a value for {' and '.join(slots)}."
        )
    values: dict[str, SlotValue] = {}
    for slot, value in slots.items():
        kind: Any = type(value)
        if isinstance(value, tuple):
            kind = tuple[int, ...] if isinstance(value[0], int) else tuple[str, ...]
        values[slot] = converted(literal.when[slot], kind, f"{where}, when.{slot}")
    return Goal.of(**values)


@functools.cache
def _example(task: str) -> Goal:
    """Return a goal of a task, which has the slots of all of its goals."""
    return get_episode(task, "random", 0).goal


def _sentence(text: str, where: str) -> str:
    """Return the words of a sentence, which has no marks."""
    try:
        parts = parse(text)
    except ValueError as error:
        raise InvalidValueError(f"{where} {error}.") from None
    if not text.strip() or any(not isinstance(part, TaggedText) for part in parts):
        raise InvalidValueError(f"{where} has the text {text!r}; it must be a whole sentence.")
    return text


def literal_refusal(request: InstructionRequest, literals: Literals, whose: str) -> str | None:
    """Return why there is no sentence for an episode; None if there is one."""
    goal = request.episode.goal
    if goal in literals:
        return None
    return f"{whose} has no sentence of {request.task.name} for the goal: {_in_words(goal)}"


def _in_words(goal: Goal) -> str:
    return describe_goal(goal.as_mapping())


def say_literal(request: InstructionRequest, literals: Literals) -> InstructionSpec:
    """Return the sentence for an episode; it means every goal of which the file says the same."""
    goal = request.episode.goal
    sentence = literals[goal]
    meant = [other for other, words in literals.items() if words == sentence]
    notes: dict[str, object] = {"command": sentence, "template_slots": sorted(goal.as_mapping())}
    command = UtteranceSpec("command", plain(sentence))
    return InstructionSpec((command,), notes, Meaning({}, goals=tuple(meant)))


def in_literals(literals: Literals, whose: str) -> Setting:
    """Return the explicit setting in whole sentences; `whose` says in refusals where from."""
    return replace(
        all_settings()[EXPLICIT],
        say=functools.partial(say_literal, literals=literals),
        refusal=functools.partial(literal_refusal, literals=literals, whose=whose),
    )
