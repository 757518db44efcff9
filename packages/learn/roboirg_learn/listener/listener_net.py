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
        self._task_numbers = {task: number for number, task in enumerate(vocabulary.tasks)}
        # The task is the first token, from which the parts of answers are scored.
        self.tasks = nn.Embedding(len(vocabulary.tasks), WIDTH)
        self.encoder = transformer(WIDTH, HEADS, LAYERS)
        self.answer = nn.Linear(WIDTH, len(vocabulary.parts))
        self.goals = {task: _goal_parts(task, vocabulary.parts) for task in vocabulary.tasks}

    def forward(self, inputs: Sequence[ListenerInput]) -> list[Tensor]:
        """Return for each input the scores (goals,) of its task's goals, in the schema's order.

        The transformer reads a token of the task and those of all encoders. From the task's token
        every part of an answer gets a score; a goal's score is the sum of its parts'.
        """
        task_numbers = torch.tensor([self._task_numbers[given.task] for given in inputs])
        values = [self.tasks(task_numbers)[:, None]]
        is_there = [torch.ones(len(inputs), 1, dtype=torch.bool)]
        for encoder in self.encoders.values():
            tokens = encoder(inputs)
            values.append(tokens.values)
            is_there.append(tokens.there)

        is_padding = ~torch.cat(is_there, 1)
        encoded = self.encoder(torch.cat(values, 1), src_key_padding_mask=is_padding)
        part_scores = self.answer(encoded[:, 0])  # from the token of the task, (n, parts)
        goal_scores = []
        for given, scores in zip(inputs, part_scores, strict=True):
            goal_scores.append(self.goals[given.task] @ scores)
        return goal_scores


def transformer(width: int, heads: int, layers: int) -> nn.TransformerEncoder:
    """Return an untrained transformer encoder for tokens (n, tokens, width), without dropout."""
    layer = nn.TransformerEncoderLayer(
        width, heads, 2 * width, dropout=0.0, batch_first=True, norm_first=True
    )
    return nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)


def _goal_parts(task: str, parts: Sequence[str]) -> Tensor:
    """Return which parts each goal of a task has: 1 or 0, (goals, parts), in the schema's order.

    With the parts (color=blue, color=red) the goal red is the row [0, 1].
    """
    answers = list(goal_schema(task).goals)
    has_part = torch.zeros(len(answers), len(parts))
    for row, answer in zip(has_part, answers, strict=True):
        for part in parts_of(answer):
            row[parts.index(part)] = 1.0
    return has_part
