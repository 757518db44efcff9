"""Find the words of a text that name a value of a goal slot, such as *red* for the slot ``color``.

It goes by single words and their neighbors, without grammar, and knows nothing of the scene.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.reader.tokens import (
    ADVERBS,
    Sentence,
    color_of,
    number_of,
    ordinal_of,
    split_sentences,
    word_set,
)
from roboirg.shortcuts.goal_vocabulary import GoalVocabulary, SlotVocabulary, Value

POINTING = word_set("the that this those these which other each every any no")
"""Before a cardinal they make it a pronoun: *the one there*, *those two*."""
PRONOUNS = word_set("them these those")
COMPARISONS = word_set("fewer less more earlier later")
"""One or two words after a number they make it a difference: *one time fewer*."""
STEPS = word_set("before after")
"""The same in slots for ordinals: *two visits before that*."""
EXCLUSIONS = word_set("other another different new not neither nor except unlike")
"""Before a word they say that its value is not the one meant."""
REFERENCES = word_set("than as half twice double before after following preceding")
"""Before a number they say that the one meant is another, which follows from it."""
POINTERS = {
    "former": 0, "first": 0, "earlier": 0, "latter": 1, "second": 1, "last": 1, "later": 1,
}  # fmt: skip
"""Words that point at the first or the second of two values."""
OPPOSITES = word_set("other not no")
"""In the sentence of a pointer they say that it is about the value that is not meant."""
ONE = word_set("one ones")
"""After an ordinal: *the second one* is no number, and no element of a series."""
_AFTER_RANK = ONE | {"of"}
"""After an ordinal they say that it is no value: *the second one*, *the second of them*."""
_RANKED = word_set("of color place one")
"""After *the* and an ordinal they say that it is the rank of something introduced."""
_REACH = 5
"""How many words before a value one of `EXCLUSIONS` may stand: *not the one right before*."""
_NUMBER_REACH = 3
"""How many words before a number one of `REFERENCES` may stand: *two more than three*."""


class NamedValue(NamedTuple):
    """A value that a text names.

    Attributes:
        value: the value; a number need not be in the slot's vocabulary.
        is_stated: whether the last sentence states it plainly, *take the red one*, so that nothing
            is left to guess.
    """

    value: Value
    is_stated: bool


def named_values(text: str, slot: str, vocabulary: SlotVocabulary) -> tuple[NamedValue, ...]:
    """Return every value of a goal slot that an instruction names, in order, with repetitions.

    *There is a red cube. Take the blue one.* -> red, not stated, and blue, stated. The last
    sentence is taken for the command; only the command can state a value.

    Args:
        text: of the instruction.
        slot: name of the goal slot, such as ``color``.
        vocabulary: the values that the slot may hold.
    """
    sentences = _sentences(text)
    found = []
    for number, words in enumerate(sentences, start=1):
        is_command = number == len(sentences)
        for mention in _mentions(words, slot, vocabulary):
            is_stated = is_command and _is_stated_plainly(words, mention)
            found.append(NamedValue(mention.value, is_stated))
    return tuple(found)


def stated_values(text: str, slot: str, vocabulary: SlotVocabulary) -> tuple[Value, ...]:
    """Return the values of a goal slot that the last sentence states plainly, in order.

    *There is a red cube. Take the blue one.* -> blue.
    """
    named = named_values(text, slot, vocabulary)
    return tuple(mention.value for mention in named if mention.is_stated)


def marked_text(text: str, slot: str, vocabulary: SlotVocabulary) -> str:
    """Return a text in which each value of a goal slot is replaced by its rank.

    The value that is named first has rank 0: for the slot ``color``, *Red and blue; not the blue
    one* becomes *rank0 and rank1 not the rank1 one*.
    """
    marked_words: list[str] = []
    ranks: dict[Value, int] = {}
    for sentence in _sentences(text):
        words = list(sentence)
        for mention in _mentions(sentence, slot, vocabulary):
            rank = ranks.setdefault(mention.value, len(ranks))
            words[mention.word_index] = f"rank{rank}"
        marked_words += words
    return " ".join(marked_words)


# Cached: every slot and every rule reads the same text.
@functools.lru_cache(maxsize=1024)
def _sentences(text: str) -> tuple[Sentence, ...]:
    return split_sentences(text)


def command_words(text: str) -> Sentence:
    """Return the words of the last sentence, ``("take", "the", "cube")``; empty without one."""
    sentences = _sentences(text)
    return sentences[-1] if sentences else ()


def pointed_index(text: str) -> int | None:
    """Return at which of two named values the sentences before the command point.

    *I mean the latter.* -> 1, the second; *It is not the second one.* -> 0, the first; None if they
    point at neither.

    The last such word decides. *Other*, *not* or *no* anywhere in its sentence reverse it; that is
    a heuristic, which misreads *not the former but the latter*.
    """
    before_command = _sentences(text)[:-1]
    for words in reversed(before_command):
        pointed = [POINTERS[word] for word in words if word in POINTERS]
        # Without "one", as in "first, listen", these words point at no value.
        if pointed and _has_pointer(words):
            is_opposite = not OPPOSITES.isdisjoint(words)
            return 1 - pointed[-1] if is_opposite else pointed[-1]
    return None


def _has_pointer(words: Sentence) -> bool:
    """Return whether a sentence has *former*, *latter*, *first one* or *second one*."""
    if "former" in words or "latter" in words:
        return True
    for word, following in itertools.pairwise(words):
        if word in ("first", "second") and following in ONE:
            return True
    return False


def thing_count(text: str, thing: str, vocabulary: GoalVocabulary) -> int:
    """Return how many things a command seems to ask for, by its surface: at least 1.

    That is the largest of several counts: of words such as *the second one*, of stated values, and
    of nouns. *Take the red cube and the blue cube* -> 2. A goal's largest number of values is the
    limit.

    Args:
        text: an instruction, whose last sentence is the command.
        thing: noun for what the task handles, in the singular: ``cube``.
        vocabulary: of the task's goals.
    """
    counts = [1, len(command_ranks(text)), _noun_count(text, thing)]
    for slot, slot_vocabulary in vocabulary.items():
        if slot_vocabulary.longest > 1:
            counts.append(len(stated_values(text, slot, slot_vocabulary)))
    longest = max(slot.longest for slot in vocabulary.values())
    return min(longest, max(counts))


def _noun_count(text: str, noun: str) -> int:
    """Return how often a command has a noun, in the singular or plural: *cube* or *cubes*."""
    forms = (noun, f"{noun}s", f"{noun}es")
    return sum(word in forms for word in command_words(text))


def command_ranks(text: str) -> tuple[int, ...]:
    """Return which of the things that were named before a command asks for, as indices from 0.

    *Take the former* -> 0; *take the second one and the third one* -> 1 and 2; *take the red one*
    -> none.
    """
    words = command_words(text)
    ranks = []
    for index, word in enumerate(words):
        ordinal = ordinal_of(word)
        if word in ("former", "latter"):
            ranks.append(POINTERS[word])
        elif ordinal is not None and _is_rank_in_list(words, index):
            ranks.append(ordinal - 1)
    return tuple(ranks)


def _is_rank_in_list(words: Sentence, index: int) -> bool:
    """Return whether the ordinal at an index counts things that were named: *the second one*.

    That of *the second visit* does not, as it is a value by itself.
    """
    following = words[index + 1 : index + 2]
    return _word_before(words, index) == "the" and not _RANKED.isdisjoint(following)


def _word_before(words: Sentence, index: int) -> str:
    """Return the word before an index; empty at the beginning."""
    return words[index - 1] if index > 0 else ""


class _Mention(NamedTuple):
    """A word that names a value: its index in the sentence, and the value."""

    word_index: int
    value: Value


def _mentions(words: Sentence, slot: str, vocabulary: SlotVocabulary) -> Iterator[_Mention]:
    """Yield the words of a sentence that name values of a goal slot, in order.

    *take the red one , not the blue one* -> the words 2 (red) and 7 (blue) for the slot ``color``.
    """
    # All values of a slot have one type.
    if all(isinstance(value, int) for value in vocabulary.values):
        yield from _number_mentions(words, slot)
        return
    for index, word in enumerate(words):
        value = color_of(word) or word
        neighbors = words[max(0, index - 1) : index + 2]
        # "Before or after" leaves open which of the two it is.
        if value in vocabulary.values and "or" not in neighbors:
            yield _Mention(index, value)


def _number_mentions(words: Sentence, slot: str) -> Iterator[_Mention]:
    """Yield the words of a sentence that name a number that could be the value of a goal slot.

    *Three times* -> 3, *twice* -> 2; *two more times* -> none, as it is a difference. In slots for
    visits and placements ordinals count, too: *the second visit* -> 2, *the second one* -> none.
    """
    has_ordinals = is_ordinal_slot(slot)
    for index, word in enumerate(words):
        following = words[index + 1 : index + 2]
        number: int | None = None
        if word in ADVERBS:
            if not _is_factor(following):
                number = ADVERBS[word]
        elif number_of(word) is not None:
            if _counts_things(words, index, slot):
                number = number_of(word)
        elif has_ordinals and _AFTER_RANK.isdisjoint(following):
            number = ordinal_of(word)
        if number is not None:
            yield _Mention(index, number)


def is_ordinal_slot(slot: str) -> bool:
    """Return whether the values of a slot can be said as ordinals: *the second visit*."""
    return SLOT_TYPE_NAMES.get(slot) in ("visit", "placement")


def _is_factor(following: Sequence[str]) -> bool:
    """Return whether *twice* multiplies the words after it: *twice as many*, *twice three*."""
    return any(word in ("as", "that", "the") or number_of(word) is not None for word in following)


def _counts_things(words: Sentence, index: int, slot: str) -> bool:
    """Return whether the cardinal number at an index says how many.

    | words | result |
    | --- | --- |
    | *three cubes*, *these three times* | yes |
    | *those two*, *the one there* | no: a pronoun |
    | *one time fewer*; for ordinals *two visits before* | no: a difference |
    | *the second three* | no: what it counts is a rank |
    | *one of them* | only in the slot ``counts``, where it is one cube |
    """
    word_before = _word_before(words, index)
    two_after = words[index + 1 : index + 3]
    if ordinal_of(word_before) is not None:
        return False
    if word_before in POINTING and two_after[:1] != ("times",):  # but "this three times"
        return False
    is_part = two_after[:1] == ("of",) and not PRONOUNS.isdisjoint(two_after)  # "one of them"
    if is_part and slot != "counts":
        return False
    if is_ordinal_slot(slot) and not STEPS.isdisjoint(two_after):
        return False
    return COMPARISONS.isdisjoint(two_after)


def _is_stated_plainly(words: Sentence, mention: _Mention) -> bool:
    """Return whether a command says a value without excluding it or counting from it.

    *Not the red one* excludes red; *two more than three* counts from three.
    """
    before = words[: mention.word_index]
    if isinstance(mention.value, str):
        return EXCLUSIONS.isdisjoint(before[-_REACH:])
    if "each" in before:  # "half as many of each as two red and four blue"
        return False
    return REFERENCES.isdisjoint(before[-_NUMBER_REACH:])
