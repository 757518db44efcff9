"""Which task an episode is of, from its words and what is seen at the beginning."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from roboirg_learn.listener.object_relations import ObjectsInView
from roboirg_learn.listener.vocabulary import Vocabulary, split_words

WIDTH = 32
OBJECT_WEIGHT = 0.3
"""What each object of a class adds to the input for that class."""


class TaskNet(nn.Module):
    """Scores the tasks of a vocabulary.

    Args:
        vocabulary: of words, classes and tasks.
    """

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        self._words = {word: number for number, word in enumerate(vocabulary.words)}
        self._size = len(self._words) + len(vocabulary.classes) + 1
        self.layers = nn.Sequential(
            nn.Linear(self._size, WIDTH), nn.ReLU(), nn.Linear(WIDTH, len(vocabulary.tasks))
        )

    def forward(self, texts: Sequence[str], seen: Sequence[ObjectsInView]) -> Tensor:
        """Return logits (n, tasks) for n instructions, each with what is seen in its scene.

        The input is a bag of words and objects: 1 for each known word that the instruction uses,
        `OBJECT_WEIGHT` for each object of each class in the first picture, and 1 if there is a
        video, which has two pictures.
        """
        rows = torch.zeros(len(texts), self._size)
        for row, text, objects in zip(rows, texts, seen, strict=True):
            for word in split_words(text):
                if word in self._words:
                    row[self._words[word]] = 1.0
            for class_number in objects.classes[objects.views == 0]:
                row[len(self._words) + int(class_number)] += OBJECT_WEIGHT
            has_video = objects.looks > 1
            row[-1] = float(has_video)
        scores: Tensor = self.layers(rows)
        return scores
