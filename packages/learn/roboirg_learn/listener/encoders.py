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
        # 0 is padding, 1 an unknown word.
        self._numbers = {word: place + 2 for place, word in enumerate(vocabulary.words)}
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
    """A token for each object that the detector found: its class, picture, place and ranks."""

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        classes = len(vocabulary.classes)
        # One layer for each property of an object; a token is the sum of what they return.
        self.kinds = nn.Embedding(classes, WIDTH)
        self.views = nn.Embedding(VIEWS, WIDTH)
        self.places = nn.Linear(4 * WAVES + 2, WIDTH)
        self.relations = nn.Linear(relation_count(classes), WIDTH, bias=False)

    def forward(self, inputs: Sequence[ListenerInput]) -> InputTokens:
        """Return a token for each object that is seen, padded to the input with most objects."""
        kinds = _padded([given.seen.kinds for given in inputs])
        views = _padded([given.seen.views for given in inputs])
        places = _padded([given.seen.positions for given in inputs]) / METERS
        relations = _padded([given.seen.relations for given in inputs]).float()
        values = self.kinds(kinds) + self.views(views) + self.places(waves(places, WAVES))

        counts = torch.tensor([len(given.seen.kinds) for given in inputs])
        is_object = torch.arange(kinds.shape[1]) < counts[:, None]
        return InputTokens(values + self.relations(relations), is_object)


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


def waves(places: Tensor, count: int) -> Tensor:
    """Return places followed by sines and cosines of them: (..., 4 * count + 2).

    A network separates places near each other by the fast waves, and far ones by the slow.

    Args:
        places: (..., 2) in units that the slowest wave spans about once.
        count: number of frequencies, each twice the one before.
    """
    scales = math.pi * 2.0 ** torch.arange(count)
    angles = (places[..., None] * scales).flatten(-2)
    return torch.cat([places, angles.sin(), angles.cos()], -1)
