"""What a listener reads and names: an instruction with what is seen, words, parts of goals."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, get_args

from roboirg.extension.episodes import goal_schema
from roboirg_learn.labeled_views import Pixels
from roboirg_learn.listener.object_relations import ObjectsInView

_WORD = re.compile(r"\d+(?:st|nd|rd|th)?|[a-z']+|[.,]")
"""A number such as 3 or 3rd, a word, or a stop: "Pick it, 2nd." → pick, it, ",", 2nd, "."."""
_CARDINALS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_ORDINALS = (
    "zeroth", "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth",
    "tenth",
)  # fmt: skip


def _number_words() -> dict[str, str]:
    """Return the words of digits up to 10: "2" → two; "2nd", and also "2th", → second."""
    found = {}
    for number, (cardinal, ordinal) in enumerate(zip(_CARDINALS, _ORDINALS, strict=True)):
        found[str(number)] = cardinal
        for ending in ("st", "nd", "rd", "th"):
            found[f"{number}{ending}"] = ordinal
    return found


_DIGIT_WORDS = _number_words()
WordPool = Literal["train", "test"]
WORD_POOLS: tuple[WordPool, ...] = get_args(WordPool)
USUAL_ENCODERS: Mapping[str, dict[str, Any]] = {"words": {}, "objects": {}}
"""The encoders of a reader, with the settings of each."""


class Vocabulary(NamedTuple):
    """What a listener can read and name, as plain data for the trained file.

    The place of each is its number in trained networks.

    Attributes:
        words: known words.
        classes: classes of objects.
        tasks: names of tasks.
        parts: parts of answers, such as ``color=red`` and ``colors.0=blue``.
    """

    words: tuple[str, ...]
    classes: tuple[str, ...]
    tasks: tuple[str, ...]
    parts: tuple[str, ...]

    @classmethod
    def of(cls, content: Mapping[str, Sequence[str]]) -> Vocabulary:
        """Return the vocabulary of a trained file's content."""
        return cls(**{name: tuple(value) for name, value in content.items()})


class ListenerInput(NamedTuple):
    """One instruction with what is seen.

    Attributes:
        task: name of the task.
        text: everything that was said.
        seen: objects of one or two pictures, with ranks.
        pictures: the pictures themselves; none in training unless an encoder reads pixels.
    """

    task: str
    text: str
    seen: ObjectsInView
    pictures: tuple[Pixels, ...] = ()


def split_words(text: str) -> list[str]:
    """Return the words and stops of a text, in lower case; digits up to 10 become words.

    "Pick it up 2 times." → pick, it, up, two, times, "."
    """
    return [_DIGIT_WORDS.get(word, word) for word in _WORD.findall(text.lower())]


def words_of(texts: Iterable[str]) -> tuple[str, ...]:
    """Return the words of texts, each once, sorted."""
    found: set[str] = set()
    for text in texts:
        found.update(split_words(text))
    return tuple(sorted(found))


def parts_of(answer: str) -> list[str]:
    """Return the parts of an answer, given as canonical JSON.

    Example: ``{"colors": ["red"]}`` has the parts ``colors.length=1`` and ``colors.0=red``.
    """
    found = []
    for name, value in json.loads(answer).items():
        if isinstance(value, list):
            found.append(f"{name}.length={len(value)}")
            found += [f"{name}.{index}={item}" for index, item in enumerate(value)]
        else:
            found.append(f"{name}={value}")
    return found


def parts_of_tasks(tasks: Iterable[str]) -> tuple[str, ...]:
    """Return the parts that the answers of tasks can have, sorted; a part's place is its number."""
    found = set()
    for task in tasks:
        for answer in goal_schema(task).goals:
            found.update(parts_of(answer))
    return tuple(sorted(found))


def make_vocabulary(
    texts: Iterable[str], classes: Iterable[str], tasks: Sequence[str]
) -> Vocabulary:
    """Return the vocabulary of texts, classes of objects and the answers of tasks.

    Args:
        texts: whose words are known.
        classes: in the order of their numbers.
        tasks: names of tasks.
    """
    return Vocabulary(
        words_of(texts),
        tuple(classes),
        tuple(tasks),
        parts_of_tasks(tasks),
    )
