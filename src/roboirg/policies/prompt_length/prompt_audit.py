"""What of an instruction reaches a language model that reads a limited number of tokens.

A prompt is cut at its end. Before it is counted, it is stripped, and underscores and line breaks
become spaces, as openpi and LeRobot do. A tokenizer says where its tokens end; without one there
are two bounds, between which every tokenizer of the compared systems lies.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from roboirg.core.delivery import PromptVerdict
from roboirg.language.token_counts import ADDED_TOKENS, count_tokens

LINE_BREAK_TOKENS = 1
"""The line break that follows the words in a prompt."""
_WORD_OR_MARK = re.compile(r"[^\s.,:;?!]+|[.,:;?!]")
_WORD = re.compile(r"\S+")
_BLANK = str.maketrans("_\n", "  ")


class Tokens(NamedTuple):
    """A prompt in tokens.

    Attributes:
        before: tokens before the words.
        ends: for each token of the words, the character at which it ends; ascending.
        after: tokens after the words.
    """

    before: int
    ends: tuple[int, ...]
    after: int

    @property
    def total(self) -> int:
        """Number of all tokens."""
        return self.before + len(self.ends) + self.after


Tokenize = Callable[[str], Tokens]
"""Splits a cleaned prompt into tokens."""


class PromptLimit(NamedTuple):
    """What a policy declares about its prompt.

    Attributes:
        tokens: that its model reads of a prompt; the rest is cut off at the end.
        added: most tokens after the words that share this budget, of a state or a subgoal.
        tokenize: of the model; None if it is not known.
        tokenizer: name of the tokenizer's file; None without one.
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
        most: tokens that it needs at most.
        reached: for each utterance, the characters from its beginning that can arrive.
        verdict: ``heard`` if every message is, ``cut`` if one is, else ``unknown``.
    """

    least: int
    most: int
    reached: tuple[int, ...]
    verdict: PromptVerdict

    def lost(self, spans: Iterable[tuple[int, int]]) -> tuple[int, ...]:
        """Return the indices of the spans that certainly do not arrive whole.

        What is not said yet is not lost.

        Args:
            spans: of each the utterance and the character after its end.
        """
        return tuple(
            index
            for index, (utterance, end) in enumerate(spans)
            if utterance < len(self.reached) and end > self.reached[utterance]
        )


def clean_prompt(text: str, *, lowers: bool = False) -> str:
    """Return a prompt as it is counted; all characters but outer blanks keep their places."""
    text = text.translate(_BLANK)
    if lowers:
        # A few letters of other alphabets become two.
        text = "".join(low if len(low := letter.lower()) == 1 else letter for letter in text)
    return text.strip()


def fewest_tokens(text: str) -> Tokens:
    """Return the tokens of a vocabulary that has every word: no tokenizer joins words."""
    return Tokens(0, tuple(found.end() for found in _WORD_OR_MARK.finditer(text)), 0)


def most_tokens(text: str) -> Tokens:
    """Return the tokens of a vocabulary of 32,000 pieces (`roboirg.language.token_counts`).

    The pieces of a word end with the word, so that a word counts once it is whole.
    """
    ends: list[int] = []
    for found in _WORD.finditer(text):
        word = found[0]
        start = found.start()
        # A letter beyond ASCII may need a token for each of its bytes.
        count = count_tokens(word) - ADDED_TOKENS + len(word.encode()) - len(word)
        ends += [start] * (count - 1) + [found.end()]
    return Tokens(ADDED_TOKENS - LINE_BREAK_TOKENS, tuple(ends), LINE_BREAK_TOKENS)


def audit_instruction(messages: Sequence[Sequence[str]], limit: PromptLimit) -> InstructionAudit:
    """Return what of an instruction reaches the model.

    Args:
        messages: each with its utterances, which are sent together, joined by spaces.
        limit: of every message.
    """
    least = most = 0
    reached: list[int] = []
    for turns in messages:
        low, high, end = _audit_message(" ".join(turns), limit)
        least, most = max(least, low), max(most, high)
        for turn in turns:
            reached.append(min(max(end, 0), len(turn)))
            end -= len(turn) + 1
    verdict: PromptVerdict = "cut" if least > limit.tokens else "unknown"
    return InstructionAudit(
        least, most, tuple(reached), "heard" if most <= limit.tokens else verdict
    )


def _audit_message(text: str, limit: PromptLimit) -> tuple[int, int, int]:
    """Return the fewest and the most tokens of a message, and how many characters arrive."""
    # Lower case needs no more tokens than what is counted without a tokenizer.
    cleaned = clean_prompt(text, lowers=limit.lowers and limit.tokenize is not None)
    least = (limit.tokenize or fewest_tokens)(cleaned)
    most = most_tokens(cleaned) if limit.tokenize is None else least
    room = limit.tokens - least.before
    reached = len(text)
    if room < len(least.ends):
        reached = len(text) - len(text.lstrip()) + (least.ends[room - 1] if room > 0 else 0)
    return least.total, most.total + limit.added, reached
