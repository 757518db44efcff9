"""Count the tokens that an instruction needs, mostly without a tokenizer.

Many policies cut what they hear after a fixed number of tokens, most often 64, some 48. The count
here is that of a SentencePiece vocabulary of 32,000 pieces, the one of the first Mistral models
(`mistral-common` ships it), and two more: the beginning of the text and the line break that openpi
adds. The tokenizers of the compared systems know 49,000 to 257,000 pieces and need fewer. Such a
vocabulary never joins words, so a sentence needs as many pieces as its words and marks.
"""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable, Mapping
from importlib.resources import files

ADDED_TOKENS = 2
"""The beginning of the text, and a line break after it."""
USUAL_LIMIT = 64
"""Tokens that the systems of the paper read; the pi0.5 baseline of MME-VLA among them."""
SHORT_LIMIT = 48
"""Tokens that pi0 and SmolVLA read."""

_WORD = re.compile(r"[^\s.,:;?!]+|[.,:;?!]")


@functools.lru_cache(maxsize=100)  # the longest text of many is asked for again and again
def tokens_of(text: str) -> int:
    """Return the number of tokens of any text.

    Exact if a tokenizer is installed; else words that the language does not use count high.
    """
    encode = _tokenizer()
    if encode is None:
        return count_tokens(text)
    return len(encode(text)) + ADDED_TOKENS


def tokens_shown(text: str) -> str:
    """Return the number of tokens of a text, to be printed: ``51``, or a bound, ``at most 51``.

    It is exact if the table has all its words or the tokenizer is installed.
    """
    if split_words(text) <= _tokens_by_word().keys():
        return str(count_tokens(text))  # exact, without loading a tokenizer
    number = str(tokens_of(text))
    if _tokenizer() is None:
        return f"at most {number}"
    return number


@functools.cache
def _tokenizer() -> Callable[[str], list[int]] | None:
    """Return the function that splits text into ids of tokens; None if none is installed.

    It needs `sentencepiece`, and `mistral-common` with the vocabulary of the first Mistral models.
    """
    try:
        from sentencepiece import SentencePieceProcessor

        folder = files("mistral_common")
    except ImportError:
        return None
    model = folder.joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model)).encode


def count_tokens(text: str) -> int:
    """Return the number of tokens of a text, from a table of the language's own words.

    The tokens of its words and marks are added up, with two for beginning and line break. A word
    that the table lacks counts one token for each character and one for the space before it, the
    most that such a vocabulary can need for English.
    """
    pieces = _tokens_by_word()
    words: list[str] = _WORD.findall(text)
    return ADDED_TOKENS + sum(pieces.get(word, len(word) + 1) for word in words)


def split_words(text: str) -> frozenset[str]:
    """Return the words and marks of a text: ``Lift it.`` gives ``{"Lift", "it", "."}``."""
    return frozenset(_WORD.findall(text))


@functools.cache
def _tokens_by_word() -> Mapping[str, int]:
    """Return the number of tokens of every word and mark of the language: ``{"cube": 2, ".": 1}``.

    The file has them the other way round: for each number of tokens the words that need
    that many.
    """
    text = files("roboirg.language").joinpath("token_pieces.json").read_text(encoding="utf-8")
    by_count: dict[str, list[str]] = json.loads(text)
    pieces: dict[str, int] = {}
    for count, words in by_count.items():
        pieces |= dict.fromkeys(words, int(count))
    return pieces
