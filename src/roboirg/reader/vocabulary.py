"""Vocabulary: the verbs of commands, and words that other packages teach."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.errors import InvalidValueError
from roboirg.reader import tokens
from roboirg.reader.phrases import KNOWN_WORDS
from roboirg.reader.tokens import FILLERS, color_of, number_of, ordinal_of, word_set

_VERBS: Mapping[str, str] = {
    "take": "take taking pick picking grab grabbing grasp grasping lift lifting raise raising get "
    "getting fetch fetching collect collecting retrieve retrieving remove removing",
    "uncover": "uncover uncovering reveal revealing expose exposing show showing find finding "
    "unveil unveiling open opening",
    "move": "move moving bring bringing carry carrying transfer transferring transport "
    "transporting "
    "swing swinging deliver delivering",
    "put": "put putting place placing set setting drop dropping lay laying deposit depositing "
    "insert "
    "inserting throw throwing toss tossing lower lowering return returning release releasing leave "
    "leaving rest goes go",
    "press": "press pressing push pushing hit hitting tap tapping",
    "stop": "stop stopping halt halting freeze freezing",
    "repeat": "repeat repeating do doing perform performing",
}
"""Verbs of commands by what they ask for; the first verb of a line stands for all in it."""
VERB_OF: dict[str, str] = {}
for _verb, _words in _VERBS.items():
    VERB_OF.update(dict.fromkeys(_words.split(), _verb))
"""The verb that stands for each verb: ``VERB_OF["grab"]`` is ``"take"``."""

LOWERING = word_set("lower lowering release releasing return returning")
"""Verbs that say by themselves that something is put down: *release it*."""
UNSEEN_COLORS = word_set(
    "orange pink white black brown cyan magenta violet turquoise silver gold "
    "beige maroon teal navy crimson scarlet lime olive"
)
"""Words that name a color that nothing on the table has; they are unknown, but called a color."""


def is_known(word: str) -> bool:
    """Return whether the interpreter knows a word: a verb, number, color, or word of a pattern.

    A known word may still be left unread, where no pattern fits it with the words around it.
    """
    if number_of(word) is not None or ordinal_of(word) is not None or color_of(word) is not None:
        return True
    return word in VERB_OF or word in KNOWN_WORDS or word in FILLERS or word in tokens.SYNONYMS


def register_words(synonyms: Mapping[str, str]) -> None:
    """Make the interpreter read new words of another package as words that it knows.

    It adds them to `tokens.SYNONYMS` for the whole process. Call it in the module of the task or
    setting that uses the words; a second call with the same words changes nothing:

        register_words({"crate": "box", "hoist": "lift"})

    Args:
        synonyms: new words in lower case, each with the known word as which it is read.

    Raises:
        InvalidValueError: a word is known already, or is to be read as an unknown one.
    """
    for word, meaning in synonyms.items():
        if tokens.SYNONYMS.get(word) == meaning:
            continue
        if is_known(word):
            raise InvalidValueError(
                f"The interpreter already knows the word {word!r}; teach it another one."
            )
        if not is_known(meaning):
            raise InvalidValueError(
                f"{word!r} is to be read as {meaning!r}, a word that the interpreter does not know."
            )
        tokens.SYNONYMS[word] = meaning
