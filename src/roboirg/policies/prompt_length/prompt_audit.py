"""What of an instruction reaches a language model that reads a limited number of tokens.

A prompt is cut at its end. Before it is counted, it is stripped, and underscores and line breaks
become spaces, as openpi and LeRobot do. A tokenizer says where its tokens end; without one there
are two bounds, between which every tokenizer of the compared systems lies.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import accumulate
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

    def reach(self, limit: int, length: int) -> int:
        """Return how many of `length` characters a model reads within a limit of tokens."""
        room = limit - self.before
        if room >= len(self.ends):
            return length
        return self.ends[room - 1] if room > 0 else 0


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


class MessageAudit(NamedTuple):
    """What of one message reaches the model.

    Attributes:
        least: tokens that it needs at least.
        most: tokens that it needs at most; equal to `least` if they were counted and none added.
        reached: characters from its beginning that can arrive.
        verdict: ``heard`` if all of it arrives, ``cut`` if something is lost, else ``unknown``.
    """

    least: int
    most: int
    reached: int
    verdict: PromptVerdict


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
        word, start = found[0], found.start()
        # A letter beyond ASCII may need a token for each of its bytes.
        count = count_tokens(word) - ADDED_TOKENS + len(word.encode()) - len(word)
        ends += [start] * (count - 1) + [found.end()]
    return Tokens(ADDED_TOKENS - LINE_BREAK_TOKENS, tuple(ends), LINE_BREAK_TOKENS)


def audit_message(text: str, limit: PromptLimit) -> MessageAudit:
    """Return what of one message reaches the model."""
    if limit.tokenize is None:
        # Lower case needs no more tokens than what is counted here.
        cleaned = clean_prompt(text)
        bounds = fewest_tokens(cleaned), most_tokens(cleaned)
    else:
        cleaned = clean_prompt(text, lowers=limit.lowers)
        bounds = (limit.tokenize(cleaned),) * 2
    least, most = bounds[0].total, bounds[1].total + limit.added
    indent = len(text) - len(text.lstrip())
    found = bounds[0].reach(limit.tokens, len(cleaned))
    reached = len(text) if found == len(cleaned) else indent + found
    verdict: PromptVerdict = "unknown"
    if most <= limit.tokens:
        verdict = "heard"
    elif least > limit.tokens:
        verdict = "cut"
    return MessageAudit(least, most, reached, verdict)


def audit_instruction(messages: Sequence[Sequence[str]], limit: PromptLimit) -> InstructionAudit:
    """Return what of an instruction reaches the model.

    Args:
        messages: each with its utterances, which are sent together, joined by spaces.
        limit: of every message.
    """
    audits = [audit_message(" ".join(turns), limit) for turns in messages]
    verdicts = {one.verdict for one in audits}
    reached: list[int] = []
    for turns, audit in zip(messages, audits, strict=True):
        starts = accumulate((len(turn) + 1 for turn in turns[:-1]), initial=0)
        reached += [
            min(max(audit.reached - start, 0), len(turn))
            for start, turn in zip(starts, turns, strict=True)
        ]
    verdict: PromptVerdict = "heard" if verdicts <= {"heard"} else "unknown"
    return InstructionAudit(
        max((one.least for one in audits), default=0),
        max((one.most for one in audits), default=0),
        tuple(reached),
        "cut" if "cut" in verdicts else verdict,
    )
