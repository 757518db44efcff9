"""A small transformer that reads words and the objects of the pictures, and scores goals."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from roboirg.apps.learning.listener.object_relations import VIEWS, ObjectsInView, relation_count
from roboirg.policies.vlm.goal_schema import goal_schema

WIDTH, HEADS, LAYERS = 96, 4, 3
MAX_WORDS = 96
WAVES = 6
"""Frequencies of the sines that encode a place."""
METERS = 0.5
"""Of a place, which the longest wave spans about once."""
PADDING, UNKNOWN = 0, 1
_WORD = re.compile(r"[a-z']+|[.,]")


class Vocabulary(NamedTuple):
    """What a listener can name: all plain data, for the checkpoint.

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


class ListenerInput(NamedTuple):
    """One instruction with what is seen.

    Attributes:
        task: name of the task.
        text: everything that was said.
        seen: objects of one or two pictures.
    """

    task: str
    text: str
    seen: ObjectsInView


def split_words(text: str) -> list[str]:
    """Return the words and stops of a text, in lower case."""
    return _WORD.findall(text.lower())


def parts_of(answer: str) -> list[str]:
    """Return the parts of an answer, given as canonical JSON."""
    found = []
    for name, value in json.loads(answer).items():
        if isinstance(value, list):
            found.append(f"{name}.length={len(value)}")
            found += [f"{name}.{place}={one}" for place, one in enumerate(value)]
        else:
            found.append(f"{name}={value}")
    return found


def make_vocabulary(
    texts: Iterable[str], classes: Iterable[str], tasks: Sequence[str]
) -> Vocabulary:
    """Return the vocabulary of texts, classes of objects and the answers of tasks."""
    answers = (answer for task in tasks for answer in goal_schema(task).goals)
    return Vocabulary(
        tuple(sorted({word for text in texts for word in split_words(text)})),
        tuple(sorted(set(classes))),
        tuple(tasks),
        tuple(sorted({part for answer in answers for part in parts_of(answer)})),
    )


class ListenerNet(nn.Module):
    """Scores the goals of a task for an instruction and the objects in view.

    Args:
        vocabulary: of words, classes, tasks and parts of answers.
    """

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        self._numbers = {word: place + 2 for place, word in enumerate(vocabulary.words)}
        self._tasks = {task: place for place, task in enumerate(vocabulary.tasks)}
        self.words = nn.Embedding(len(vocabulary.words) + 2, WIDTH, padding_idx=PADDING)
        self.order = nn.Parameter(torch.randn(MAX_WORDS, WIDTH) * 0.02)
        self.kinds = nn.Embedding(len(vocabulary.classes), WIDTH)
        self.views = nn.Embedding(VIEWS, WIDTH)
        self.places = nn.Linear(4 * WAVES + 2, WIDTH)
        self.relations = nn.Linear(relation_count(len(vocabulary.classes)), WIDTH, bias=False)
        self.tasks = nn.Embedding(len(vocabulary.tasks), WIDTH)
        layer = nn.TransformerEncoderLayer(
            WIDTH, HEADS, 2 * WIDTH, dropout=0.1, batch_first=True, norm_first=True
        )
        self.encoder = nn.TransformerEncoder(layer, LAYERS, enable_nested_tensor=False)
        self.answer = nn.Linear(WIDTH, len(vocabulary.parts))
        numbers = {part: place for place, part in enumerate(vocabulary.parts)}
        self.goals = {
            task: torch.stack(
                [_marked(parts_of(answer), numbers) for answer in goal_schema(task).goals]
            )
            for task in vocabulary.tasks
        }

    def forward(self, inputs: Sequence[ListenerInput]) -> list[Tensor]:
        """Return for each input the scores of its task's goals, in the order of the schema."""
        words = _padded([self._word_numbers(one.text) for one in inputs])
        seen, is_seen = self._encode_objects(inputs)
        tasks = self.tasks(torch.tensor([self._tasks[one.task] for one in inputs]))[:, None]
        said = self.words(words) + self.order[: words.shape[1]]
        hidden = torch.cat(
            [torch.zeros(len(inputs), 1, dtype=torch.bool), words == PADDING, ~is_seen], 1
        )
        encoded = self.encoder(torch.cat([tasks, said, seen], 1), src_key_padding_mask=hidden)
        parts = self.answer(encoded[:, 0])
        return [self.goals[one.task] @ own for one, own in zip(inputs, parts, strict=True)]

    def _word_numbers(self, text: str) -> list[int]:
        # The command stands at the end.
        words = split_words(text)[-MAX_WORDS:]
        return [self._numbers.get(word, UNKNOWN) for word in words]

    def _encode_objects(self, inputs: Sequence[ListenerInput]) -> tuple[Tensor, Tensor]:
        """Return embeddings (n, most objects, WIDTH), and which of them there are."""
        counts = [len(one.seen.kinds) for one in inputs]
        shape = len(inputs), max(counts)
        kinds, views = (torch.zeros(shape, dtype=torch.long) for _ in range(2))
        places = torch.zeros(*shape, 2)
        relations = torch.zeros(*shape, self.relations.in_features)
        for number, (one, count) in enumerate(zip(inputs, counts, strict=True)):
            kinds[number, :count] = torch.from_numpy(one.seen.kinds)
            views[number, :count] = torch.from_numpy(one.seen.views)
            places[number, :count] = torch.from_numpy(one.seen.positions) / METERS
            relations[number, :count] = torch.from_numpy(one.seen.relations)
        there = torch.arange(shape[1]) < torch.tensor(counts)[:, None]
        encoded = self.kinds(kinds) + self.views(views) + self.places(waves(places, WAVES))
        return encoded + self.relations(relations), there


def waves(places: Tensor, count: int) -> Tensor:
    """Return places (..., 2) with sines and cosines of `count` rising frequencies."""
    scales = math.pi * 2.0 ** torch.arange(count)
    angles = (places[..., None] * scales).flatten(-2)
    return torch.cat([places, angles.sin(), angles.cos()], -1)


def _padded(rows: Sequence[Sequence[int]]) -> Tensor:
    longest = max(map(len, rows))
    padded = [[*row, *[PADDING] * (longest - len(row))] for row in rows]
    return torch.tensor(padded, dtype=torch.long)  # also where nothing is said


def _marked(parts: Iterable[str], numbers: dict[str, int]) -> Tensor:
    found = torch.zeros(len(numbers))
    found[[numbers[part] for part in parts]] = 1.0
    return found
