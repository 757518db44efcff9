"""Control arms: the same scene again with other words, another goal or another policy seed."""

from __future__ import annotations

import re
from collections.abc import Mapping

from roboirg.core.errors import InvalidValueError, UnknownNameError

TOLD = "told"
OTHER_GOAL = "other-goal"
SILENT = "silent"
SILENT_EMPTY = "silent-empty"
SCRAMBLED = "scrambled"
PARAPHRASE = "paraphrase"
AGAIN = "again"

SILENT_TEXTS = {SILENT: "Please do your task.", SILENT_EMPTY: ""}
ARMS: Mapping[str, str] = {
    TOLD: "the scene's own goal in the words of the setting",
    OTHER_GOAL: "another goal of the same scene, stated in the same setting, and judged by it",
    SILENT: f"the whole instruction replaced by '{SILENT_TEXTS[SILENT]}'",
    SILENT_EMPTY: "no words at all",
    SCRAMBLED: "the content words in random order",
    PARAPHRASE: "another text of the same goal, in the same setting and pool of words",
    AGAIN: "the same words, with another policy seed",
}
"""The kinds of arms, and what is said. Paraphrases are numbered, from ``paraphrase-1``."""

PARAPHRASES = 2
"""How many of them ``paraphrase`` alone stands for."""
MOST_PARAPHRASES = 20
_MOST_DIGITS = 3
"""Of a number of paraphrases that is read at all."""

_NUMBERED = re.compile(rf"{PARAPHRASE}-([1-9]\d?)")


def paraphrase_number(arm: str) -> int | None:
    """Return the number of a paraphrase, from 1; None for another arm."""
    found = _NUMBERED.fullmatch(arm)
    return None if found is None else int(found[1])


def check_arm(arm: str) -> None:
    """Check the name of a control arm: ``"silent"``, or with its number ``"paraphrase-1"``.

    Raises:
        UnknownNameError: there is no such arm.
    """
    is_known = arm in ARMS and arm != PARAPHRASE
    number = paraphrase_number(arm)
    if number is not None:
        is_known = number <= MOST_PARAPHRASES
    if not is_known:
        known = [f"{name}-1" if name == PARAPHRASE else name for name in ARMS]
        raise UnknownNameError("arm", arm, known)


def parse_arm(text: str) -> tuple[str, ...]:
    """Return the names of the control arms that a user's text stands for.

    ``"silent"`` -> ``("silent",)``; ``"paraphrase:2"`` -> ``("paraphrase-1", "paraphrase-2")``;
    without a number, `PARAPHRASES` of them.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: the number of paraphrases is out of range.
    """
    name, colon, typed_count = text.partition(":")
    if name != PARAPHRASE:
        check_arm(text)
        return (text,)
    count = PARAPHRASES
    if colon:
        is_number = typed_count.isdecimal() and len(typed_count) <= _MOST_DIGITS
        count = int(typed_count) if is_number else 0  # 0 is refused, too
    if not 1 <= count <= MOST_PARAPHRASES:
        raise InvalidValueError(
            f"The arm {text!r} must have a number of paraphrases from 1 to {MOST_PARAPHRASES}, "
            f"such as {PARAPHRASE}:{PARAPHRASES}."
        )
    return tuple(f"{PARAPHRASE}-{number}" for number in range(1, count + 1))
