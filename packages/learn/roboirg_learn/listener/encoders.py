"""Encoders: what makes tokens for the reader from the words or the pictures of an instruction.

A token is a row of `WIDTH` numbers that stands for one word or one object. An encoder of your own
is one class with a name in `ENCODERS`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.utils.rnn import pad_sequence

from roboirg.extension.commands import InvalidValueError, known_name
from roboirg_learn.listener.object_relations import VIEWS, relation_count
from roboirg_learn.listener.vocabulary import ListenerInput, Vocabulary, split_words

WIDTH = 96
"""Numbers of a token."""
MAX_WORDS = 96
FREQUENCIES = 6
"""Of the Fourier features that encode a position."""
METERS = 0.5
"""Unit of positions: the slowest sine spans it about once."""
PADDING, UNKNOWN = 0, 1
"""Numbers of no word, and of a word that is not in the vocabulary; known words begin at 2."""


class InputTokens(NamedTuple):
    """Tokens of n inputs (n, tokens, WIDTH), and `there` (n, tokens), False for padding."""

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
    """A token for each word: its embedding, and that of its position in the text."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        self._numbers = {word: number for number, word in enumerate(vocabulary.words, UNKNOWN + 1)}
        self.words = nn.Embedding(len(vocabulary.words) + 2, WIDTH, padding_idx=PADDING)
        self.order = nn.Parameter(torch.randn(MAX_WORDS, WIDTH) * 0.02)

    def forward(self, inputs: Sequence[ListenerInput]) -> InputTokens:
        """Return a token for each word of each text, padded to the longest."""
        rows = [torch.tensor(self._row(given.text), dtype=torch.long) for given in inputs]
        numbers = pad_sequence(rows, batch_first=True, padding_value=PADDING)
        order = self.order[: numbers.shape[1]]
        return InputTokens(self.words(numbers) + order, numbers != PADDING)

    def _row(self, text: str) -> list[int]:
        """Return the numbers of the last `MAX_WORDS` words: at the end of a text is the command."""
        words = split_words(text)[-MAX_WORDS:]
        return [self._numbers.get(word, UNKNOWN) for word in words]


class ObjectEncoder(TokenEncoder):
    """A token for each object that the detector found: its class, picture, position and ranks."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        classes = len(vocabulary.classes)
        # One layer for each property of an object; a token is the sum of what they return.
        self.kinds = nn.Embedding(classes, WIDTH)
        self.views = nn.Embedding(VIEWS, WIDTH)
        self.places = nn.Linear(4 * FREQUENCIES + 2, WIDTH)
        self.relations = nn.Linear(relation_count(classes), WIDTH, bias=False)

    def forward(self, inputs: Sequence[ListenerInput]) -> InputTokens:
        """Return a token for each object that is seen, padded to the input with most objects."""
        classes = _padded([given.seen.classes for given in inputs])
        views = _padded([given.seen.views for given in inputs])
        positions = _padded([given.seen.positions for given in inputs]) / METERS
        relations = _padded([given.seen.relations for given in inputs]).float()
        values = self.kinds(classes) + self.views(views)
        values = values + self.places(fourier_features(positions, FREQUENCIES))
        values = values + self.relations(relations)

        counts = torch.tensor([len(given.seen.classes) for given in inputs])
        is_object = torch.arange(classes.shape[1]) < counts[:, None]
        return InputTokens(values, is_object)


def _padded(arrays: Sequence[NDArray[Any]]) -> Tensor:
    """Return n arrays (objects, …) as one tensor (n, most objects, …), filled up with zeros."""
    return pad_sequence([torch.from_numpy(array) for array in arrays], batch_first=True)


ENCODERS: dict[str, type[TokenEncoder]] = {"words": WordEncoder, "objects": ObjectEncoder}


def make_encoders(
    vocabulary: Vocabulary, settings: Mapping[str, Mapping[str, Any]]
) -> nn.ModuleDict:
    """Return untrained encoders by name, for a reader of words.

    Args:
        vocabulary: words and classes that they encode.
        settings: by the name of each encoder, its keyword arguments.

    Raises:
        UnknownNameError: there is none of that name.
        InvalidValueError: one does not take its settings.
    """
    found = nn.ModuleDict()
    for name, chosen in settings.items():
        encoder = ENCODERS[known_name("encoder", name, tuple(ENCODERS))]
        try:
            found[name] = encoder(vocabulary, **chosen)
        except (TypeError, ValueError) as error:
            raise InvalidValueError(f"Encoder {name!r} with {chosen}: {error}.") from error
    return found


def fourier_features(positions: Tensor, count: int) -> Tensor:
    """Return positions followed by sines and cosines of them: (..., 4 * count + 2).

    A network tells positions near each other apart by the fast ones, and far ones by the slow.

    Args:
        positions: (..., 2) in units that the slowest sine spans about once.
        count: number of frequencies, each twice the one before.
    """
    frequencies = math.pi * 2.0 ** torch.arange(count)
    angles = (positions[..., None] * frequencies).flatten(-2)
    return torch.cat([positions, angles.sin(), angles.cos()], -1)
