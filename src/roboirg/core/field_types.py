"""Types of the fields of stored data: texts and numbers that every reader can show and hold."""

from __future__ import annotations

import re
from typing import Annotated

import msgspec

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import clip_text
from roboirg.core.subgoal_text import MOST_SUBGOAL_LETTERS

MOST_NAME_LETTERS = 1000
CONTROLS = "\\x00-\\x1f\\x7f-\\x9f\\u200e\\u200f\\u202a-\\u202e\\u2066-\\u2069"
"""Characters that control a terminal or the direction of reading, for a set in a pattern."""
NAME = f"^[^{CONTROLS}]{{0,{MOST_NAME_LETTERS}}}\\Z"
"""A name in a record: text without characters that control a terminal or reorder what is read."""

_READ_AS_NO_TEXT = (
    r"(?i:[\d., ]*(?:\de[+-]?\d+)?|true|false|inf(?:inity)?"
    r"|<?nan?>?|#?n/?a(?: n/a)?|null|none|1\.#(?:ind|qnan))\Z"
)
"""What programs that read a table take for a number, a flag or a missing value."""
LABEL = NAME.replace("^", f"^(?![=+@-])(?!{_READ_AS_NO_TEXT})", 1)
"""A name that heads a row or column.

Spreadsheets compute what begins with such a sign; other programs change ``007``, and lose ``NA``.
"""
LABEL_RULE = (
    "at most 1,000 characters, none of = + - @ at the beginning, without control characters, and "
    "nothing that is read as a number, a flag or a missing value, such as 007, true or NA"
)
SUBGOAL = f"^[^{CONTROLS}]{{1,{MOST_SUBGOAL_LETTERS}}}\\Z"
Subgoal = Annotated[str, msgspec.Meta(pattern=SUBGOAL)]
Name = Annotated[str, msgspec.Meta(pattern=NAME)]
Label = Annotated[str, msgspec.Meta(pattern=LABEL)]
MOST_WHOLE = 2**63 - 1
Whole = Annotated[int, msgspec.Meta(ge=-MOST_WHOLE - 1, le=MOST_WHOLE)]
"""A whole number that tables and NumPy can hold."""
MOST_SECONDS = 2_147_483
"""Of a time limit, 24 days: systems wait for at most 2 ** 31 ms."""
MOST_COUNT = 1_000_000_000
"""Of steps, frames, tokens or tries in an option; more is a mistake."""
MOST_STAGES = 100
Stages = Annotated[tuple[Whole, ...], msgspec.Meta(max_length=MOST_STAGES)]
MOST_CAUSE_LETTERS = 10_000
Cause = Annotated[str, msgspec.Meta(max_length=MOST_CAUSE_LETTERS)]


def check_whole(name: str, value: object, least: int = 1, most: int = MOST_COUNT) -> int:
    """Return a value if it is a whole number from `least` to `most`; True and False are none.

    Args:
        name: of the value, with which the message begins.
        value: any object; 2.0 and ``"2"`` are refused, too.
        least: smallest allowed number.
        most: largest allowed number.

    Raises:
        InvalidValueError: it is not.
    """
    if type(value) is int and least <= value <= most:
        return value
    raise InvalidValueError(
        f"{name} is {value!r}; it must be a whole number from {least} to {most:,}."
    )


def check_policy_name(name: str) -> None:
    """Check the name of a policy, which heads rows of tables.

    Raises:
        InvalidValueError: it is not a `LABEL`.
    """
    if not re.fullmatch(LABEL, name):
        raise InvalidValueError(
            f"Policy {name[:80]!r} has no valid name for records: {LABEL_RULE}."
        )


def described(text: str) -> dict[str, str]:
    """Return the metadata of an option's field with what the option means."""
    return {"help": text}


def as_name(text: str) -> str:
    """Return any text from outside as a name, which may hold no characters that control a terminal.

    They are written as escapes: an escape character becomes the four letters ``x1b`` behind a
    backslash. Long texts are cut.
    """
    shown = re.sub(f"[{CONTROLS}]", _escape, text)
    return clip_text(shown, MOST_NAME_LETTERS)


def _escape(found: re.Match[str]) -> str:
    r"""Return a character as an escape: ``\x1b``."""
    quoted = ascii(found[0])
    return quoted[1:-1]
