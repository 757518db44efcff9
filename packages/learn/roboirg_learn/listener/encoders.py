"""Encoders: what makes tokens for the reader from the words or the pictures of an instruction.

An encoder of your own is one class with a name in `ENCODERS`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import torch
from torch import Tensor, nn

from roboirg.extension.commands import InvalidValueError, known_name
from roboirg_learn.listener.object_relations import VIEWS, relation_count
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, split_words

WIDTH = 96
"""Numbers of a token."""
MAX_WORDS = 96
WAVES = 6
"""Frequencies of the sines that encode a place."""
METERS = 0.5
"""Of a place, which the longest wave spans about once."""
PADDING, UNKNOWN = 0, 1


class InputTokens(NamedTuple):
    """Tokens of n inputs: (n, tokens, WIDTH), and (n, tokens) False for padding."""

    values: Tensor
    there: Tensor


class TokenEncoder(nn.Module):
    """Makes `InputTokens` of a sequence of `ListenerInput`, and is trained with the reader.

    It is made with the vocabulary and, by keyword, its settings: plain data, which the trained file
    keeps. A text may be empty, and nothing may be seen.
    """

    reads_pixels: ClassVar[bool] = False
    """Whether inputs must have pictures, not only the objects that are seen."""


class WordEncoder(TokenEncoder):
    """A token for each word: its embedding, and that of its place."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        self._numbers = {word: place + 2 for place, word in enumerate(vocabulary.words)}
        self.words = nn.Embedding(len(vocabulary.words) + 2, WIDTH, padding_idx=PADDING)
        self.order = nn.Parameter(torch.randn(MAX_WORDS, WIDTH) * 0.02)

    def forward(self, inputs: Sequence[ListenerInput]) -> InputTokens:
        # The command stands at the end.
        rows = [
            [self._numbers.get(word, UNKNOWN) for word in split_words(one.text)[-MAX_WORDS:]]
            for one in inputs
        ]
        longest = max(map(len, rows))
        padded = [[*row, *[PADDING] * (longest - len(row))] for row in rows]
        words = torch.tensor(padded, dtype=torch.long)  # also where nothing is said
        return InputTokens(self.words(words) + self.order[:longest], words != PADDING)


class ObjectEncoder(TokenEncoder):
    """A token for each object that the detector found: its class, picture, place and ranks."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        classes = len(vocabulary.classes)
        self.kinds = nn.Embedding(classes, WIDTH)
        self.views = nn.Embedding(VIEWS, WIDTH)
        self.places = nn.Linear(4 * WAVES + 2, WIDTH)
        self.relations = nn.Linear(relation_count(classes), WIDTH, bias=False)

    def forward(self, inputs: Sequence[ListenerInput]) -> InputTokens:
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
        return InputTokens(encoded + self.relations(relations), there)


ENCODERS: dict[str, type[TokenEncoder]] = {"words": WordEncoder, "objects": ObjectEncoder}


def make_encoders(
    vocabulary: Vocabulary, settings: Mapping[str, Mapping[str, Any]]
) -> nn.ModuleDict:
    """Return untrained encoders.

    Raises:
        UnknownNameError: there is none of that name.
        InvalidValueError: one does not take its settings.
    """
    found = nn.ModuleDict()
    for name, own in settings.items():
        encoder = ENCODERS[known_name("encoder", name, tuple(ENCODERS))]
        try:
            found[name] = encoder(vocabulary, **own)
        except (TypeError, ValueError) as error:
            raise InvalidValueError(f"Encoder {name!r} with {own}: {error}.") from error
    return found


def waves(places: Tensor, count: int) -> Tensor:
    """Return places (..., 2) with sines and cosines of `count` rising frequencies."""
    scales = math.pi * 2.0 ** torch.arange(count)
    angles = (places[..., None] * scales).flatten(-2)
    return torch.cat([places, angles.sin(), angles.cos()], -1)
