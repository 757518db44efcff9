"""A small transformer that reads words and the objects of the pictures, and scores goals.

It scores the parts of answers, such as ``color=red``; a goal's score is the sum of its parts'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from roboirg.extension.episodes import goal_schema
from roboirg_learn.listener.encoders import WIDTH, make_encoders
from roboirg_learn.listener.vocabulary import (
    USUAL_ENCODERS,
    ListenerInput,
    Vocabulary,
    parts_of,
)

HEADS = 4
LAYERS = 3


class ListenerNet(nn.Module):
    """Scores the goals of a task for instructions with what is seen.

    Args:
        vocabulary: of words, classes, tasks and parts of answers.
        settings: of each of its encoders.
    """

    def __init__(
        self, vocabulary: Vocabulary, settings: Mapping[str, Mapping[str, Any]] = USUAL_ENCODERS
    ) -> None:
        super().__init__()
        self.encoders = make_encoders(vocabulary, settings)
        self._tasks = {task: place for place, task in enumerate(vocabulary.tasks)}
        self.tasks = nn.Embedding(len(vocabulary.tasks), WIDTH)
        self.encoder = transformer(WIDTH, HEADS, LAYERS)
        self.answer = nn.Linear(WIDTH, len(vocabulary.parts))
        self.goals = {task: _goal_parts(task, vocabulary.parts) for task in vocabulary.tasks}

    def forward(self, inputs: Sequence[ListenerInput]) -> list[Tensor]:
        """Return for each input the scores of its task's goals, in the order of the schema."""
        numbers = torch.tensor([self._tasks[given.task] for given in inputs])
        values = [self.tasks(numbers)[:, None]]
        is_there = [torch.ones(len(inputs), 1, dtype=torch.bool)]
        for encoder in self.encoders.values():
            tokens = encoder(inputs)
            values.append(tokens.values)
            is_there.append(tokens.there)

        is_padding = ~torch.cat(is_there, 1)
        encoded = self.encoder(torch.cat(values, 1), src_key_padding_mask=is_padding)
        parts = self.answer(encoded[:, 0])  # of the token of the task
        goals = [self.goals[given.task] for given in inputs]
        return [goal @ row for goal, row in zip(goals, parts, strict=True)]


def transformer(width: int, heads: int, layers: int) -> nn.TransformerEncoder:
    """Return untrained layers of attention, for tokens of `width` numbers."""
    layer = nn.TransformerEncoderLayer(
        width, heads, 2 * width, dropout=0.0, batch_first=True, norm_first=True
    )
    return nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)


def _goal_parts(task: str, parts: Sequence[str]) -> Tensor:
    """Return for each goal of a task 1 at each of its parts, else 0: (goals, parts)."""
    answers = list(goal_schema(task).goals)
    found = torch.zeros(len(answers), len(parts))
    for row, answer in zip(found, answers, strict=True):
        for part in parts_of(answer):
            row[parts.index(part)] = 1.0
    return found
