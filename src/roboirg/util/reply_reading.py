"""Read what a model replied: its answer without thoughts, a JSON object, a letter, numbers.

These are the only rules for replies; whatever queries a model reads with them. `docs/only-vlm.md`
explains them to users.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

import msgspec

_THOUGHTS_END = re.compile(
    # Not at the end of a text in JSON.
    r"""(?i)(?:</(?:think|thinking|thought|thoughts|reasoning)>|\[/THINK\])(?!"\s*[,\]}])"""
    r"|◁/think▷|<\|channel\|>final<\|message\|>"
)
_ANSWER_ENDS = re.compile(
    r"""(?i)(?:<(?:think|thinking|thought|thoughts|reasoning)>|\[THINK\])(?!"\s*[,\]}])"""
    r"|◁think▷|<\|channel\|>(?:analysis|commentary)\b"
    r"|<\|(?:im_end|endoftext|end|return|eot_id|cut_off)\|>|</s>"
)
"""Where thoughts begin, or a token at the end of a reply."""
CUT_OFF = "<|cut_off|>"
"""Ends the text of a reply that its service broke off at the limit of tokens."""

_JSON_BEGINS = re.compile(
    r"""(?mx)
    \{(?!\s*[^\s{}"'“”:=,/][^{}"'“”:=,/]*(?:\}|(?<=\w)\{))
    | \[(?=\s*\{)
    | ^[ \t]*\}
    """
)
"""An object, a list of objects, or a stray brace; not braces around words, as in *\\boxed{B}*."""

_DECISIVE = re.compile(
    r"""(?imx)
    (?:
        (?P<line>^[^\w\n]*(?:(?:choice|option)\b[^\w\n]*)?)
        | \b(?:answer|(?:best|correct|final|my|right)\s+(?:choice|option|one))\b
          # At most twelve of these words: a text of nothing else is read in linear time.
          (?:[^\w.?!]+(?:be|choice|correct|is|letter|must|option|right|should|the|would)\b){0,12}
          [^\w.?!]*
        | \\boxed\{(?:\\\w+\{)?[^\w}]*
    )
    (?P<letter>[A-D])(?![\w'’\u0300-\u036f\u20d0-\u20ff-])
    (?(line)
        [^\w\n]*$
        # *A cube* names no choice, while *A because …* does; *A or B* names two.
        | (?!(?<=a)[ \t]+(?!(?:and|as|because|is|since)\b)(?-i:[a-z]))
          (?!(?=\W*[A-D]\b)[^\w,/&]*[,/&])
          (?!\W*\b(?:or|and)\b\W*[A-D]\b)
    )
    """
)
"""A letter alone on its line, after *answer* and the like, or in a box; none with a combining mark,
which may strike it out."""
_SUGGESTED = re.compile(
    r"""(?imx)
    (?: ^[^\w\n]*(?:(?:choice|option)\b[^\w\n]*)? | \*\*[(\[]? )
    (?P<letter>[A-D])
    (?=
        [.:)\]*] | \s*[(–—] | [ \t]+- | [ \t]+(?-i:[A-Z][a-z])
        | ,?[ \t]+(?:as|because|since|is[ ](?:correct|my|right|the))\b
    )
    """
)
"""A letter at the beginning of a line, or in bold."""

_CLAUSE_ENDS = re.compile(r"[,;]|(?<=[.!?])\s+|(?<![:\s])\s*\n")
_DOUBTS = re.compile(
    r"""(?x)
    \?|~~|n['’]t\b
    | (?i:\b(?:cannot|hmm|neither|never|no|none|nor|not|wait)\b)
    | (?i:\b(?:eliminated|excluded|false|incorrect|invalid|least|ruled|unlikely|wrong)\b)
    | (?i:\b(?:except|if|unless)\b)
    # A letter on its own; *A cube* has none.
    | (?<![\w'’-])(?:A(?![ \t]+[a-z])|[B-D])(?![\w'’-])
    """
)
"""Questions, negations, conditions and letters."""
_UNSURE = "?"
_WINDOW = 500
"""Characters before and after a letter in which its clause and its line are searched."""


class UnparsableReplyError(Exception):
    """A reply is unusable; `VLMQuery.ask` sends the message to the model and asks again."""


def with_thoughts(answer: str, thoughts: Sequence[Any]) -> str:
    """Return a reply as one text that keeps the model's thoughts, which `answer_of` leaves out.

    Args:
        answer: what the model said.
        thoughts: JSON values in which its service reports thoughts.
    """
    if not thoughts:
        return answer
    return f"<think>{json.dumps(thoughts, ensure_ascii=False)}</think>\n{answer}"


def check_whole(text: str) -> None:
    """Raise if a reply ends with `CUT_OFF`, because what looks like its answer may be a draft.

    If the end of a JSON object, or of a code fence, is the last that it says, it is whole.

    Raises:
        UnparsableReplyError: it was cut off.
    """
    is_whole = answer_of(text).endswith(("}", "```"))
    if text.endswith(CUT_OFF) and not is_whole:
        raise UnparsableReplyError(
            "The reply was cut off at the limit of tokens; give the answer alone."
        )


def answer_of(text: str) -> str:
    """Return a reply without the thoughts in it, and without the tokens at its end.

    ``"<think>red or blue?</think> red <|im_end|>"`` -> ``"red"``. What follows the last end of
    thoughts is the answer, up to thoughts that break off. The tag at their beginning may be
    missing, as some services put it into the prompt.
    """
    after_thoughts = _THOUGHTS_END.split(text)[-1]
    return _ANSWER_ENDS.split(after_thoughts)[0].strip()


def json_object(text: str) -> dict[str, Any]:
    """Return the last JSON object in a reply, which may have words or a code fence around it.

    It may be the only item of a list.

    Raises:
        UnparsableReplyError: there is none, one is malformed, or the last ones are a list.
    """
    found = last_json(text)
    if isinstance(found, list) and len(found) == 1:
        found = found[0]
    if not isinstance(found, dict):
        raise UnparsableReplyError("The reply holds no JSON object, or several in a list.")
    return found


def last_json(text: str) -> Any:  # noqa: ANN401 - JSON
    """Return the last JSON object in a reply, or the last list of objects; None without any.

    ``Not {"a": 1}, but {"a": 2}.`` -> ``{"a": 2}``. Thoughts are left out first.

    Raises:
        UnparsableReplyError: a brace belongs to no well-formed object, so that none is sure to be
            last.
    """
    answer = answer_of(text)
    # Texts may have line breaks.
    decoder = json.JSONDecoder(strict=False, object_pairs_hook=_distinct_fields)
    found = None
    begin = _JSON_BEGINS.search(answer)
    while begin is not None:
        try:
            found, end = decoder.raw_decode(answer, begin.start())
        except (ValueError, RecursionError):
            raise UnparsableReplyError("A JSON object breaks off or is malformed.") from None
        begin = _JSON_BEGINS.search(answer, end)
    return found


def _distinct_fields(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object from its fields; raise `ValueError` if it has one of them twice."""
    fields = dict(pairs)
    if len(fields) < len(pairs):
        raise ValueError("a field is given twice")
    return fields


def chosen_letter(text: str, letters: str) -> str:
    """Return the letter that a reply chooses, in upper case: ``The answer is b.`` -> ``B``.

    If the reply has a JSON object with the field ``choice`` or ``answer``, only that is read.
    Letters alone on a line, after *answer* and in boxes decide; only without any do those that
    begin a line or are set in bold.

    Args:
        text: the reply.
        letters: those that may be chosen, such as ``"ABC"``.

    Raises:
        UnparsableReplyError: it names none of the letters from A to D, several different ones, one
            in doubt, or one that is not among `letters`.
    """
    found = last_json(text)
    answer = answer_of(text)
    if isinstance(found, dict):
        fields = [str(found[name]) for name in ("choice", "answer") if name in found]
        answer = "\n".join(fields) or answer
    named = _sure_letters(_DECISIVE, answer) or _sure_letters(_SUGGESTED, answer)
    if len(named) != 1 or not named <= set(letters):
        raise UnparsableReplyError("The reply has to name one of the letters.")
    return named.pop()


def _sure_letters(pattern: re.Pattern[str], answer: str) -> set[str]:
    """Return the letters that a pattern finds in an answer, `_UNSURE` for those in doubt."""
    return {_sure_letter(found) for found in pattern.finditer(answer)}


def _sure_letter(found: re.Match[str]) -> str:
    """Return the letter of a match in upper case; `_UNSURE` if words around it cast doubt on it.

    The words are those of its clause, and the rest of its line: in *not B*, B is unsure.
    """
    answer = found.string
    letter = found["letter"].upper()
    begin, end = found.span("letter")
    text_before = answer[max(0, begin - _WINDOW) : begin]
    text_after = answer[end : end + _WINDOW]
    clause = _CLAUSE_ENDS.split(text_before)[-1]
    rest_of_line = text_after.split("\n")[0]
    doubts = set(_DOUBTS.findall(f"{clause} {rest_of_line}"))
    # Another letter is a doubt, too; the same one again is none.
    return _UNSURE if doubts - {letter} else letter


def whole_number(value: object) -> int | None:
    """Return a JSON value that is a whole number, also 3.0 and "3"; None for any other."""
    try:
        return msgspec.convert(value, int, strict=False)
    except msgspec.ValidationError:
        return None


def text_of(reply: dict[str, Any], name: str) -> str:
    """Return a text field of a reply, in one line.

    Raises:
        UnparsableReplyError: there is no such text.
    """
    value = reply.get(name)
    if not isinstance(value, str) or not value.strip():
        raise UnparsableReplyError(f"The field {name!r} has to hold words.")
    return " ".join(value.split())
