"""A small transformer that reads words and the objects of the pictures, and scores goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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

HEADS, LAYERS = 4, 3


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
        self.settings = {name: dict(own) for name, own in settings.items()}
        self.encoders = make_encoders(vocabulary, settings)
        self._tasks = {task: place for place, task in enumerate(vocabulary.tasks)}
        self.tasks = nn.Embedding(len(vocabulary.tasks), WIDTH)
        self.encoder = transformer(WIDTH, HEADS, LAYERS)
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
        tasks = self.tasks(torch.tensor([self._tasks[one.task] for one in inputs]))[:, None]
        tokens = [encoder(inputs) for encoder in self.encoders.values()]
        values = torch.cat([tasks, *(one.values for one in tokens)], 1)
        there = torch.ones(len(inputs), 1, dtype=torch.bool)
        hidden = ~torch.cat([there, *(one.there for one in tokens)], 1)
        parts = self.answer(self.encoder(values, src_key_padding_mask=hidden)[:, 0])
        return [self.goals[one.task] @ own for one, own in zip(inputs, parts, strict=True)]


def transformer(width: int, heads: int, layers: int) -> nn.TransformerEncoder:
    """Return untrained layers of attention, for tokens of `width` numbers."""
    layer = nn.TransformerEncoderLayer(
        width, heads, 2 * width, dropout=0.0, batch_first=True, norm_first=True
    )
    return nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)


def _marked(parts: Iterable[str], numbers: dict[str, int]) -> Tensor:
    found = torch.zeros(len(numbers))
    found[[numbers[part] for part in parts]] = 1.0
    return found
