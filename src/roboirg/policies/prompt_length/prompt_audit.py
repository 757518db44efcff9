"""What of an instruction reaches a language model that reads a limited number of tokens.

An instruction is sent in one message or several, each with one or several utterances. A message
that is too long is cut at its end. Before it is counted, it is stripped, and underscores and line
breaks become spaces, as openpi and LeRobot do.

The model's tokenizer says where tokens end. If it is not known, a lower and an upper bound are
counted, between which every tokenizer of the compared systems lies.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from roboirg.core.delivery import PromptVerdict
from roboirg.language.token_counts import ADDED_TOKENS, count_tokens

LINE_BREAK_TOKENS = 1
"""Tokens of the line break that follows the words in a prompt."""
_WORD_OR_MARK = re.compile(r"[^\s.,:;?!]+|[.,:;?!]")
_WORD = re.compile(r"\S+")
_SPACES_FOR = str.maketrans("_\n", "  ")


class Tokens(NamedTuple):
    """A prompt in tokens: *lift it* may be ``Tokens(1, (4, 7), 1)``.

    Attributes:
        before: number of tokens before the words, such as that of the beginning of a text.
        ends: for each token of the words, the number of characters up to its end; ascending.
        after: number of tokens after the words, such as that of a line break.
    """

    before: int
    ends: tuple[int, ...]
    after: int

    @property
    def total(self) -> int:
        """Number of all tokens."""
        return self.before + len(self.ends) + self.after


Tokenize = Callable[[str], Tokens]
"""Splits a prompt that `clean_prompt` has cleaned into tokens."""


class PromptLimit(NamedTuple):
    """What a policy declares about how much of a prompt its model reads.

    Attributes:
        tokens: how many tokens the model reads of a prompt; the rest is cut off at the end.
        added: how many of these a state or a subgoal after the words may take, at most.
        tokenize: the model's tokenizer; None if it is not known.
        tokenizer: name of the tokenizer's file, for records; None without one.
        lowers: whether the prompt is sent in lower case.
    """

    tokens: int
    added: int = 0
    tokenize: Tokenize | None = None
    tokenizer: str | None = None
    lowers: bool = False


class InstructionAudit(NamedTuple):
    """What of an instruction reaches the model.

    Attributes:
        least: tokens that the longest message needs at least.
        most: tokens that it needs at most; `least` if the tokenizer is known.
        reached: for each utterance, how many characters from its beginning can reach the model.
        verdict: ``heard`` if every message certainly reaches the model whole, ``cut`` if one
            certainly does not, else ``unknown``.
    """

    least: int
    most: int
    reached: tuple[int, ...]
    verdict: PromptVerdict

    def lost(self, spans: Iterable[tuple[int, int]]) -> tuple[int, ...]:
        """Return the indices of the spans of text that certainly do not reach the model whole.

        Of two utterances of which 20 and 5 characters are reached, the spans ``(0, 12)`` and ``(1,
        9)`` give ``(1,)``. A span in an utterance that was not said yet is not lost.

        Args:
            spans: for each, the index of its utterance and the character after its end.
        """
        lost = []
        for index, (utterance, end) in enumerate(spans):
            is_said = utterance < len(self.reached)
            if is_said and end > self.reached[utterance]:
                lost.append(index)
        return tuple(lost)


def clean_prompt(text: str, *, lowers: bool = False) -> str:
    """Return a prompt as it is counted: ``" Lift_it "`` becomes ``"Lift it"``.

    All characters but outer blanks keep their places.
    """
    text = text.translate(_SPACES_FOR)
    if lowers:
        text = "".join(map(_lowered, text))
    return text.strip()


def _lowered(letter: str) -> str:
    """Return a letter in lower case; a few, such as *İ*, would become two letters, and stay."""
    low = letter.lower()
    return low if len(low) == 1 else letter


def fewest_tokens(text: str) -> Tokens:
    """Return a lower bound of a text's tokens: one for each word and punctuation mark.

    No tokenizer joins words. *lift it.* has the ends 4, 7 and 8.
    """
    ends = tuple(word.end() for word in _WORD_OR_MARK.finditer(text))
    return Tokens(0, ends, 0)


def most_tokens(text: str) -> Tokens:
    """Return an upper bound of a text's tokens: those of a vocabulary of 32,000 pieces.

    It is not known where in a word its pieces end. All but the last are counted as ending where the
    word begins, so that the word is reached with its last token only: ``table`` in three pieces,
    which begins at character 4, has the ends 4, 4 and 9.
    """
    ends = []
    for found in _WORD.finditer(text):
        word = found[0]
        # A letter beyond ASCII may need a token for each of its bytes.
        more_bytes = len(word.encode()) - len(word)
        count = count_tokens(word) - ADDED_TOKENS + more_bytes
        ends += [found.start()] * (count - 1)
        ends.append(found.end())
    return Tokens(ADDED_TOKENS - LINE_BREAK_TOKENS, tuple(ends), LINE_BREAK_TOKENS)


def audit_instruction(messages: Sequence[Sequence[str]], limit: PromptLimit) -> InstructionAudit:
    """Return what of an instruction reaches the model.

    With a limit of 3 tokens, *lift the red cube* is ``cut``, and *lift the red* is reached, 12
    characters.

    Args:
        messages: each with its utterances, which are sent together, joined by spaces.
        limit: of every message.
    """
    least = 0
    most = 0
    reached = []
    for utterances in messages:
        audit = _audit_message(" ".join(utterances), limit)
        least = max(least, audit.least)
        most = max(most, audit.most)
        left = audit.reached  # characters of the message that reach the model
        for utterance in utterances:
            reached.append(min(max(left, 0), len(utterance)))
            left -= len(utterance) + 1  # and the space behind it

    verdict: PromptVerdict = "unknown"
    if most <= limit.tokens:
        verdict = "heard"
    elif least > limit.tokens:
        verdict = "cut"
    return InstructionAudit(least, most, tuple(reached), verdict)


class _MessageAudit(NamedTuple):
    """The fewest and the most tokens of a message, and how many characters can reach the model."""

    least: int
    most: int
    reached: int


def _audit_message(text: str, limit: PromptLimit) -> _MessageAudit:
    """Return what of one message reaches the model.

    Without a tokenizer, a lower and an upper bound of its tokens are counted, and `reached` goes by
    the lower one, so that no character is called lost that may arrive. With one, both are equal.
    """
    if limit.tokenize is None:
        # Lower case needs no more tokens than what is counted without a tokenizer.
        cleaned = clean_prompt(text)
        least = fewest_tokens(cleaned)
        most = most_tokens(cleaned)
    else:
        least = limit.tokenize(clean_prompt(text, lowers=limit.lowers))
        most = least
    room = limit.tokens - least.before  # how many tokens of words are read
    reached = len(text)
    if room < len(least.ends):
        # The ends do not count blanks at the beginning, which were stripped.
        reached = len(text) - len(text.lstrip())
        if room > 0:
            reached += least.ends[room - 1]
    return _MessageAudit(least.total, most.total + limit.added, reached)
