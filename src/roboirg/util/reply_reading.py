"""Read what a model replied: its answer without thoughts, a JSON object, a letter, numbers.

These are the only rules for replies; whatever queries a model reads with them. `docs/models.md`
explains them to users.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from typing import Any

_THOUGHTS_BEGIN = re.compile(
    r"<(?:think|thinking|thought|thoughts|reasoning)>|\[THINK\]|◁think▷"
    r"|<\|channel\|>(?:analysis|commentary)\b",
    re.IGNORECASE,
)
_THOUGHTS_END = re.compile(
    r"</(?:think|thinking|thought|thoughts|reasoning)>|\[/THINK\]|◁/think▷"
    r"|<\|channel\|>final<\|message\|>",
    re.IGNORECASE,
)
_END_TOKENS = re.compile(r"(?:(?:<\|(?:im_end|endoftext|end|return|eot_id)\|>|</s>)\s*)+$")

_OBJECT_BEGINS = re.compile(r"""\{(?=\s*(?:["'}]|\w+\s*:|$))|\[(?=\s*\{)""")
"""*{this}* is no object; an object may be malformed."""

_LETTER = r"(?P<letter>[A-D])(?![\w'’-])"
_NO_ARTICLE = r"(?!(?<=a)[ \t]+(?!(?:and|as|because|is|since)\b)(?-i:[a-z]))"
"""*A cube* names no choice, while *A because …* does."""
_LINE_BEGINS = r"^[^\w\n]*(?:(?:choice|option)\b[^\w\n]*)?"
_ALONE = rf"{_LINE_BEGINS}{_LETTER}[^\w\n]*$"
_AFTER_ANSWER = (
    r"\b(?:answer|(?:best|correct|final|my|right)\s+(?:choice|option|one))\b"
    r"(?:[^\w.?!]+(?:be|choice|correct|is|letter|must|option|right|should|the|would)\b)*"
    rf"[^\w.?!]*{_LETTER}{_NO_ARTICLE}"
)
_BOXED = rf"\\boxed\{{(?:\\\w+\{{)?[^\w}}]*{_LETTER}{_NO_ARTICLE}"
_DECISIVE = tuple(
    re.compile(pattern, re.IGNORECASE | re.MULTILINE)
    for pattern in (_ALONE, _AFTER_ANSWER, _BOXED)
)
_FOLLOWED = (
    r"(?=[.:)\]*]|\s*[(–—]|[ \t]+-|[ \t]+(?-i:[A-Z][a-z])"
    r"|,?[ \t]+(?:as|because|since|is (?:correct|my|right|the))\b)"
)
_BEGINS_LINE = rf"{_LINE_BEGINS}{_LETTER}{_FOLLOWED}"
_BOLD = rf"\*\*[(\[]?{_LETTER}(?=[.:)\]*])"
_SUGGESTED = tuple(
    re.compile(pattern, re.IGNORECASE | re.MULTILINE) for pattern in (_BEGINS_LINE, _BOLD)
)
_LETTER_FIELDS = ("choice", "answer", "letter")

_DIGITS = re.compile(r"\s*-?[0-9]{1,18}\s*")


class UnparsableReplyError(Exception):
    """A reply is unusable; `VLMQuery.ask` sends the message to the model and asks again."""


def with_thoughts(answer: str, thoughts: Sequence[Any]) -> str:
    """Return a reply as one text that keeps the model's thoughts, which `answer_of` leaves out.

    Args:
        answer: what the model said.
        thoughts: what its service reports apart from that: texts, or any JSON.
    """
    if not thoughts:
        return answer
    texts = []
    for thought in thoughts:
        text = thought if isinstance(thought, str) else json.dumps(thought, ensure_ascii=False)
        texts.append(text)
    joined = "\n".join(texts)
    return f"<think>{joined}</think>\n{answer}"


def answer_of(text: str) -> str:
    """Return a reply without the thoughts in it, and without the tokens at its end.

    What follows the last end of thoughts is the answer, up to thoughts that break off. The first
    tag may be missing, as some services put it into the prompt.
    """
    after_thoughts = _THOUGHTS_END.split(text)[-1]
    answer = _THOUGHTS_BEGIN.split(after_thoughts)[0]
    return _END_TOKENS.sub("", answer).strip()


def json_object(text: str) -> dict[str, Any]:
    """Return the last JSON object in a reply, which may have words or a code fence around it.

    It may be the only item of a list.

    Raises:
        UnparsableReplyError: there is none, the last one breaks off or is malformed, or it is one
            of several in a list.
    """
    found = last_json(text)
    if found is None:
        raise UnparsableReplyError("The reply holds no JSON object.")
    if isinstance(found, dict):
        return found
    if len(found) > 1:
        raise UnparsableReplyError("The reply holds several JSON objects in a list.")
    only: dict[str, Any] = found[0]
    return only


def last_json(text: str) -> dict[str, Any] | list[Any] | None:
    """Return the last JSON object in a reply, or the last list that begins with an object.

    None if there is none, or if the last one is malformed: an earlier one must not stand for it.

    Raises:
        UnparsableReplyError: the last one breaks off or cannot be read.
    """
    answer = answer_of(text)
    decoder = json.JSONDecoder(strict=False)  # texts may have line breaks
    found = None
    begin = _OBJECT_BEGINS.search(answer)
    while begin is not None:
        try:
            found, end = decoder.raw_decode(answer, begin.start())
        except json.JSONDecodeError as error:
            is_in_text = error.msg.startswith("Unterminated string")
            if is_in_text or error.pos >= len(answer):
                raise UnparsableReplyError("The last JSON object breaks off.") from None
            found = None
            end = begin.end()
        except (ValueError, RecursionError):  # a number of thousands of digits; too deep
            raise UnparsableReplyError("The JSON object cannot be read.") from None
        begin = _OBJECT_BEGINS.search(answer, end)
    return found


def chosen_letter(text: str) -> str:
    """Return the letter from A to D that a reply chooses, in upper case.

    A field of a JSON object decides, else the letters alone on their lines, after *answer* and in
    boxes, else those that begin a line or are set in bold.

    Raises:
        UnparsableReplyError: it names no letter, or several different ones.
    """
    found = last_json(text)
    answer = answer_of(text)
    if isinstance(found, dict):
        for name in _LETTER_FIELDS:
            if isinstance(found.get(name), str):
                answer = found[name]
                break
    letters = _letters(_DECISIVE, answer) or _letters(_SUGGESTED, answer)
    if not letters:
        raise UnparsableReplyError("The reply names no letter.")
    if len(letters) > 1:
        raise UnparsableReplyError("The reply names several different letters.")
    return letters.pop()


def _letters(patterns: Iterable[re.Pattern[str]], text: str) -> set[str]:
    """Return the different letters that the patterns find, in upper case."""
    letters = set()
    for pattern in patterns:
        for match in pattern.finditer(text):
            letters.add(match["letter"].upper())
    return letters


def whole_number(value: object) -> int | None:
    """Return a JSON value that is a whole number, also 3.0 and "3"; None for any other."""
    if isinstance(value, bool):
        return None
    if isinstance(value, str) and _DIGITS.fullmatch(value):
        return int(value)
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value if isinstance(value, int) else None


def text_of(reply: dict[str, Any], name: str) -> str:
    """Return a text field of a reply, in one line.

    Raises:
        UnparsableReplyError: there is no such text.
    """
    value = reply.get(name)
    if not isinstance(value, str) or not value.strip():
        raise UnparsableReplyError(f"The field {name!r} has to hold words.")
    return " ".join(value.split())
