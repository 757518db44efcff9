"""Find the templates behind the sentences of a task's goals.

What changes between the sentences of two goals that differ in one value names this value. Goals
for which no common template exists (once and several times, one color and two) are told apart by
conditions, as few as possible.
"""

from __future__ import annotations

import itertools
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from roboirg.core.episode import Goal, SlotValue
from roboirg.language.worded_command import goal_fields

Sentences = Mapping[Goal, str]
_TOKEN = re.compile(r"\w+|\s+|[^\w\s]")
LONGEST = 5
"""Most words that name a value; longer ones are another sentence."""
_BASES = 12
"""Goals from which to look for the words of each field."""


@dataclass(slots=True)
class DraftTemplate:
    """A template that gives the sentences of some goals exactly.

    Attributes:
        literals: the words around the fields, one more than there are fields.
        fields: in the order of the sentence.
        tables: field → value → words.
        when: the slot values that all of the goals share.
        sentences: the sentence of each goal.
    """

    literals: list[str]
    fields: list[str]
    tables: dict[str, dict[str, str]]
    when: dict[str, SlotValue] = field(default_factory=dict)
    sentences: dict[Goal, str] = field(default_factory=dict)


def find_templates(sentences: Sentences) -> list[DraftTemplate]:
    """Return templates that together give every sentence."""
    found: list[DraftTemplate] = []
    groups: dict[tuple[str, ...], dict[Goal, str]] = defaultdict(dict)
    for goal, sentence in sentences.items():
        groups[tuple(goal_fields(goal))][goal] = sentence
    for group in groups.values():
        found += next(drafts for drafts in map(_attempt, _divisions(group)) if drafts is not None)
    return found


_Division = list[tuple[dict[str, SlotValue], dict[Goal, str]]]
"""Conditions, and the sentences of the goals that meet them."""


def _divisions(group: Sentences) -> Iterator[_Division]:
    """Yield ways to tell goals apart, few conditions first; the last one always works."""
    slots = list(next(iter(group)).as_mapping())
    yield _divided(group, lambda _goal: {})
    yield _divided(group, lambda goal: {"repeats": 1} if _once(goal) else {})
    for slot in slots:
        yield _divided(group, lambda goal, slot=slot: {slot: goal[slot]})  # type: ignore[misc]
    for pair in itertools.combinations(slots, 2):
        yield _divided(group, lambda goal, pair=pair: {one: goal[one] for one in pair})  # type: ignore[misc]
    yield _divided(group, lambda goal: dict(goal.slots))


def _once(goal: Goal) -> bool:
    return goal.as_mapping().get("repeats") == 1


def _divided(group: Sentences, condition: Callable[[Goal], dict[str, SlotValue]]) -> _Division:
    found: dict[tuple[tuple[str, SlotValue], ...], dict[Goal, str]] = defaultdict(dict)
    for goal, sentence in group.items():
        found[tuple(condition(goal).items())][goal] = sentence
    # Those with conditions first: of several templates that fit, the first one is used.
    ordered = sorted(found.items(), key=lambda one: -len(one[0]))
    return [(dict(when), sentences) for when, sentences in ordered]


def _attempt(division: _Division) -> list[DraftTemplate] | None:
    found: list[DraftTemplate] = []
    for when, sentences in division:
        draft = _align(sentences, when)
        if draft is None:
            return None
        found.append(draft)
    return found


def _align(sentences: dict[Goal, str], when: dict[str, SlotValue]) -> DraftTemplate | None:
    """Return one template for all of the goals; None if there is none."""
    goals = list(sentences)
    free = [name for name in goal_fields(goals[0]) if not _pinned(name, when)]
    for base in goals[:_BASES]:
        spans = {name: _span(sentences, base, name) for name in free}
        ordered = sorted((span, name) for name, span in spans.items() if span is not None)
        if len(ordered) < len(free) or _overlapping([span for span, _ in ordered]):
            continue
        tokens = _TOKEN.findall(sentences[base])
        edges = [0, *(edge for span, _ in ordered for edge in span), len(tokens)]
        pieces = ["".join(tokens[first:last]) for first, last in itertools.pairwise(edges)]
        names = [name for _, name in ordered]
        tables = _tables(sentences, pieces[::2], names)
        if tables is not None:
            return DraftTemplate(pieces[::2], names, tables, when, sentences)
    return None


def _pinned(name: str, when: Mapping[str, SlotValue]) -> bool:
    base = name.partition(".")[0]
    return {"colors", "counts"} <= set(when) if base == "cubes" else base in when


def _span(sentences: Sentences, base: Goal, name: str) -> tuple[int, int] | None:
    """Return from which token to which a base's sentence differs from those with other values."""
    others = {key: value for key, value in goal_fields(base).items() if key != name}
    said = [
        _TOKEN.findall(sentence)
        for goal, sentence in sentences.items()
        if {key: value for key, value in goal_fields(goal).items() if key != name} == others
    ]
    shortest = min(map(len, said))
    start = _common(said, shortest)
    end = _common([tokens[::-1] for tokens in said], shortest - start)
    last = len(_TOKEN.findall(sentences[base])) - end
    return (start, last) if len(said) > 1 and start < last else None


def _common(said: Sequence[Sequence[str]], most: int) -> int:
    """Return how many tokens all begin with, at most `most`."""
    same = (len(set(column)) == 1 for column in zip(*said, strict=False))
    return min(sum(1 for _ in itertools.takewhile(bool, same)), most)


def _overlapping(spans: Sequence[tuple[int, int]]) -> bool:
    return any(first[1] > second[0] for first, second in itertools.pairwise(spans))


def _tables(
    sentences: Sentences, literals: Sequence[str], names: Sequence[str]
) -> dict[str, dict[str, str]] | None:
    """Return the words for each value; None if a sentence does not fit or contradicts others."""
    pattern = re.compile("(.+?)".join(map(re.escape, literals)))
    tables: dict[str, dict[str, str]] = {name: {} for name in names}
    for goal, sentence in sentences.items():
        found = pattern.fullmatch(sentence)
        if found is None:
            return None
        values = goal_fields(goal)
        for name, words in zip(names, found.groups(), strict=True):
            if words != words.strip() or len(words.split()) > LONGEST:
                return None
            if tables[name].setdefault(values[name], words) != words:
                return None
    return tables
