"""Tokenizers from files: SentencePiece models and the JSON of the library `tokenizers`."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.extras import extra_needed
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.prompt_length.prompt_audit import (
    LINE_BREAK_TOKENS,
    PromptLimit,
    Tokenize,
    Tokens,
)
from roboirg.util.regular_file import read_regular

JSON = ".json"
"""Suffix of files of the library `tokenizers`."""
_MAX_BYTES = 256 * 2**20
"""Largest size of a tokenizer's file."""


@functools.cache
def read_tokenizer(path: str) -> Tokenize:
    """Return the tokenizer of a file, which is read once per process.

    The tokenizer raises `InvalidValueError` for a text that it cannot split, and so does this
    function for a file that it cannot read.

    Args:
        path: ``.json`` for the library `tokenizers`, anything else for SentencePiece.
    """
    try:
        content = read_regular(Path(path), _MAX_BYTES)  # a policy may name any file
    except OSError as error:
        raise InvalidValueError(
            f"The tokenizer {path!r} is not a file; give a SentencePiece model or a tokenizer.json."
        ) from error
    except InvalidValueError as error:
        raise InvalidValueError(f"The tokenizer cannot be read: {error}") from error
    read = _read_json if path.endswith(JSON) else _read_sentencepiece
    with _attributed_to(path):
        tokenize = read(path, content)
    return _attributed_to(path)(tokenize)


@contextlib.contextmanager
def _attributed_to(path: str) -> Iterator[None]:
    """Turn what a library raises into an `InvalidValueError` about the tokenizer of a path.

    The library `tokenizers` panics on some texts, which is no `Exception`.
    """
    try:
        yield
    except (RoboIRGError, KeyboardInterrupt):
        raise
    except BaseException as error:
        kind = "SentencePiece model"
        if path.endswith(JSON):
            kind = "tokenizer of the library tokenizers"
        raise InvalidValueError(f"The tokenizer {path!r} cannot be used as a {kind}.") from error


def _read_sentencepiece(path: str, content: bytes) -> Tokenize:
    """Return the tokenizer of a SentencePiece model.

    Args:
        path: of its file, for errors.
        content: of the file.
    """
    with extra_needed(f"The tokenizer {path!r} needs sentencepiece", "tokens"):
        import sentencepiece
    model: Any = sentencepiece.SentencePieceProcessor()
    model.LoadFromSerializedProto(content)

    # Versions of the library differ: in this name, and in whether ends count characters or bytes.
    encode = getattr(model, "encode_as_immutable_proto", None) or model.encode_as_proto

    def tokenize(text: str) -> Tokens:
        """Return the tokens of a text: of *lift it* ``Tokens(before=1, ends=(4, 7), after=1)``."""
        ends = [piece.end for piece in encode(text).pieces]
        # The token before the words stands for the beginning of the text.
        return Tokens(1, _ends_in_characters(text, ends), LINE_BREAK_TOKENS)

    return tokenize


def _ends_in_characters(text: str, ends: Sequence[int]) -> tuple[int, ...]:
    """Return where tokens end, in characters from the beginning of their text.

    For *é!*, which has two characters and three bytes, ``(1, 2)`` from ``[1, 2]`` and from
    ``[2, 3]``.

    Args:
        text: that was split.
        ends: ascending, all in characters or all in bytes of UTF-8; the last token ends the text.
    """
    in_bytes = text.encode()
    # The last end shows what they count; if the text has as many bytes as characters, both.
    if not ends or ends[-1] != len(in_bytes):
        return tuple(ends)
    return tuple(len(in_bytes[:end].decode(errors="ignore")) for end in ends)


def _read_json(path: str, content: bytes) -> Tokenize:
    """Return a tokenizer of the library `tokenizers`.

    Args:
        path: of its file, for errors.
        content: of the file, JSON.
    """
    with extra_needed(f"The tokenizer {path!r} needs tokenizers", "tokens"):
        import tokenizers
    model: Any = tokenizers.Tokenizer.from_buffer(content)
    model.no_truncation()
    model.no_padding()
    # Special tokens, which the library keeps when it cuts a text.
    kept = int(model.num_special_tokens_to_add(is_pair=False))

    def tokenize(text: str) -> Tokens:
        offsets = model.encode(text, add_special_tokens=False).offsets
        ends = tuple(end for _, end in offsets)
        return Tokens(kept, ends, LINE_BREAK_TOKENS)

    return tokenize


def prompt_limit(needs: PolicyNeeds) -> PromptLimit | None:
    """Return the limit of prompts that a policy declares, with its tokenizer; None for no limit."""
    if needs.prompt_tokens is None:
        return None
    limit = PromptLimit(needs.prompt_tokens, needs.prompt_added, lowers=needs.lowers_prompt)
    if needs.tokenizer is None:
        return limit
    path = Path(needs.tokenizer)
    tokenize = read_tokenizer(str(path.absolute()))
    return limit._replace(tokenize=tokenize, tokenizer=path.name)
