"""Control arms: the same scene again with other words, another goal or another policy seed."""

from __future__ import annotations

import re

from roboirg.core.errors import InvalidValueError, UnknownNameError

TOLD = "told"
OTHER_GOAL = "other-goal"
SILENT = "silent"
SILENT_EMPTY = "silent-empty"
SCRAMBLED = "scrambled"
PARAPHRASE = "paraphrase"
AGAIN = "again"

ARMS = (TOLD, OTHER_GOAL, SILENT, SILENT_EMPTY, SCRAMBLED, PARAPHRASE, AGAIN)
"""The kinds of arms. Paraphrases are numbered: ``paraphrase-1`` is the first one."""

PARAPHRASES = 2
"""How many of them ``paraphrase`` alone stands for."""
MOST_PARAPHRASES = 20

_NUMBERED = re.compile(rf"{PARAPHRASE}-([1-9]\d?)")


def paraphrase_number(arm: str) -> int | None:
    """Return the number of a paraphrase, from 1; None for another arm."""
    found = _NUMBERED.fullmatch(arm)
    return None if found is None else int(found[1])


def check_arm(arm: str) -> None:
    """Check that there is such an arm; a paraphrase needs its number.

    Raises:
        UnknownNameError: there is none.
    """
    number = paraphrase_number(arm)
    if arm == PARAPHRASE or (arm not in ARMS and not 1 <= (number or 0) <= MOST_PARAPHRASES):
        known = [name if name != PARAPHRASE else f"{name}-1" for name in ARMS]
        raise UnknownNameError("arm", arm, known)


def parse_arm(text: str) -> tuple[str, ...]:
    """Return the arms of a name as typed: ``paraphrase:2`` is the first two paraphrases.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: the number of paraphrases is out of range.
    """
    name, colon, count = text.partition(":")
    if name != PARAPHRASE:
        check_arm(text)
        return (text,)
    number = int(count) if count.isdecimal() and len(count) < 4 else 0  # noqa: PLR2004
    if colon and not 1 <= number <= MOST_PARAPHRASES:
        raise InvalidValueError(
            f"The arm {text!r} has no number of paraphrases from 1 to {MOST_PARAPHRASES}, such as "
            f"{PARAPHRASE}:{PARAPHRASES}."
        )
    return tuple(f"{PARAPHRASE}-{one + 1}" for one in range(number or PARAPHRASES))
