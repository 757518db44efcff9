"""What of an instruction reaches a language model that reads a limited number of tokens.

An instruction is one message or several, each with its utterances. A prompt is cut at its end.
Before it is counted, it is stripped, and underscores and line breaks become spaces, as openpi and
LeRobot do. A tokenizer says where its tokens end; without one there are two bounds, between which
every tokenizer of the compared systems lies.
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
        """Return the indices of the spans that certainly do not reach the model whole.

        A span in an utterance that was not said yet is not lost.

        Args:
            spans: of each the utterance and the character after its end.
        """
        lost: list[int] = []
        for index, (utterance, end) in enumerate(spans):
            is_said = utterance < len(self.reached)
            if is_said and end > self.reached[utterance]:
                lost.append(index)
        return tuple(lost)


def clean_prompt(text: str, *, lowers: bool = False) -> str:
    """Return a prompt as it is counted; all characters but outer blanks keep their places."""
    text = text.translate(_BLANK)
    if lowers:
        text = "".join(map(_lowered, text))
    return text.strip()


def _lowered(letter: str) -> str:
    """Return a letter in lower case; a few of other alphabets would become two, and stay."""
    low = letter.lower()
    return low if len(low) == 1 else letter


def fewest_tokens(text: str) -> Tokens:
    """Return the tokens of a vocabulary that has every word: no tokenizer joins words."""
    ends = tuple(word.end() for word in _WORD_OR_MARK.finditer(text))
    return Tokens(0, ends, 0)


def most_tokens(text: str) -> Tokens:
    """Return an upper bound of a text's tokens: those of a vocabulary of 32,000 pieces.

    It is not known where in a word its pieces end. All but the last are placed at the word's begin,
    so that the word is not reached before all its tokens are: ``table`` in three pieces that begins
    at 4 has the ends 4, 4 and 9.
    """
    ends: list[int] = []
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

    Args:
        messages: each with its utterances, which are sent together, joined by spaces.
        limit: of every message.
    """
    least = 0
    most = 0
    reached: list[int] = []
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
    """The fewest and the most tokens of a message, and how many of its characters arrive."""

    least: int
    most: int
    reached: int


def _audit_message(text: str, limit: PromptLimit) -> _MessageAudit:
    """Return least and most tokens of a message, and how many of its characters surely arrive.

    Without a tokenizer, an upper and a lower bound are counted; with one, both are equal.
    """
    if limit.tokenize is None:
        # Lower case needs no more tokens than what is counted without a tokenizer.
        cleaned = clean_prompt(text)
        least = fewest_tokens(cleaned)
        most = most_tokens(cleaned)
    else:
        least = limit.tokenize(clean_prompt(text, lowers=limit.lowers))
        most = least
    room = limit.tokens - least.before  # for tokens of words
    reached = len(text)
    if room < len(least.ends):
        # Blanks at the begin are stripped before tokens are counted, so the ends lack them.
        reached = len(text) - len(text.lstrip())
        if room > 0:
            reached += least.ends[room - 1]
    return _MessageAudit(least.total, most.total + limit.added, reached)
