"""Incomplete sentences: verbs left out, and lists and exclusions that stand before their command."""

from __future__ import annotations

from roboirg.reader.command import is_command
from roboirg.reader.phrases import Phrases
from roboirg.reader.tokens import COLOR, Sentence, colors_in, number_of, ordinal_of, word_set
from roboirg.reader.vocabulary import PUTTING, TAKING

_HANDLING = TAKING | PUTTING
_NOUN_PHRASE = word_set(
    "okay so now then the a one same leftmost rightmost closest nearest farthest furthest cube "
    "cubes ones of container over and , from you red green blue reds greens blues"
)
_AFTER_NOUN = word_set(
    "to into in on onto goes go comes : target first last used where over down at"
)
_LEADING = word_set("okay so now then and ,")
_LIST = word_set("okay so first second the cube one then and is goes , ; : red green blue")
_CUBE = rf"(?:the )?{COLOR}s?(?: cubes?| ones?)?"
_UNWANTED = Phrases({
    "The red and the green cubes are not wanted.":
        rf"^{_CUBE} (?:and|or) {_CUBE} (?:are|is) (?:not|of no|no|unwanted)\b.*?(?=$|[,:;])",
    "Not the red one and not the blue one": rf"^(?:not|neither) {_CUBE} (?:, )?(?:and )?(?:not|nor) {_CUBE}(?: [:,])?",
    "I do not want the red one and I do not want the green one":
        rf"^i do not (?:want|need|like)(?: to see)? {_CUBE}(?: ,)?(?: and| or) "
        rf"(?:i do not (?:want|need|like)(?: to see)? )?{_CUBE}$",
})  # fmt: skip
_OTHER = Phrases({
    "the other one": r"\bthe (?:other|last|third)(?: (?:cube|one|color))?(?! (?:of|from|than|time|visit|to)\b)",
})  # fmt: skip


def completed(sentences: tuple[Sentence, ...]) -> tuple[Sentence, ...]:
    """Return sentences that have verbs and objects of their own: *blue cube to target, button*."""
    parts = tuple(part for words in sentences for part in _separated(words) if part)
    if all(_HANDLING.isdisjoint(words) for words in parts):
        parts = tuple(map(_with_put, parts))
    return _without_unwanted(_with_lists(tuple(map(_with_press, parts))))


def _separated(words: Sentence) -> tuple[Sentence, ...]:
    """Return the remark before a semicolon and the command after it as two sentences."""
    at = words.index(";") if ";" in words else len(words)
    before, after = words[:at], words[at + 1 :]
    both = is_command(after) and not is_command(before) and not _HANDLING.isdisjoint(after)
    press = is_command(before) and _HANDLING.isdisjoint(words) and "container" in after
    return (before, after) if both or press or ("stop" in after and not is_command(before)) else (words,)


def _with_put(words: Sentence) -> Sentence:
    """Return ``put the blue cube on the target`` for ``the blue cube goes on the target``."""
    end = next((at for at, word in enumerate(words) if not _is_of_noun(word)), len(words))
    named = any(word.startswith(("cube", "container")) for word in words[:end]) or colors_in(words[:end])
    after = words[end] if end < len(words) else ""
    lifted = "container" in words[:end]
    if not (named and (lifted or after in _AFTER_NOUN or ordinal_of(after))):
        return words
    start = next(at for at, word in enumerate(words) if word not in _LEADING)
    rest = end + (after in ("goes", "go", "comes", ":"))
    return ("lift" if lifted else "put", *words[start:end], *words[rest:])


def _is_of_noun(word: str) -> bool:
    return word in _NOUN_PHRASE or number_of(word) is not None


def _with_press(words: Sentence) -> Sentence:
    """Return ``then press the button`` for ``then button`` at the end of a sentence."""
    last = words[:-1] if words[-2:] == ("button", "press") else words
    if last[-1] not in ("button", "buttons"):
        return words
    start = len(last) - 1
    while start and last[start - 1] in ("the", "both", "two"):
        start -= 1
    if start and last[start - 1] not in (",", ";", "then", "and"):
        return words
    return (*last[:start], "press", *last[start:])


def _with_lists(sentences: tuple[Sentence, ...]) -> tuple[Sentence, ...]:
    """Return ``lift the container over red, then blue`` for ``red, then blue. Lift the containers``."""
    found: list[Sentence] = []
    for words in sentences:
        listed = found.pop() if found and len(set(colors_in(found[-1]))) > 1 and _LIST.issuperset(found[-1]) else ()
        both = (*listed, ",", *words) if listed else words
        end = next((at for at, word in enumerate(both) if word not in _LIST), len(both))
        plural = is_command(both[end:]) and ("containers" in both[end:] or "them" in both[end:])
        if plural and "container" in " ".join(both[end:]) and not colors_in(both[end:]) and len(set(colors_in(both[:end]))) > 1:
            words = ("lift", "the", "container", "over", *both[:end])
        elif listed:
            found.append(listed)
        found.append(words)
    return tuple(found)


def _without_unwanted(sentences: tuple[Sentence, ...]) -> tuple[Sentence, ...]:
    """Return ``lift the cube that is neither red nor green`` after *the red and green are not wanted*."""
    for at, words in enumerate(sentences):
        text = " ".join(words)
        found = _UNWANTED.search(text) if {"not", "no", "neither", "unwanted"}.intersection(words) else None
        if found is None or len(set(colors_in(tuple(found[0].split())))) != 2:  # noqa: PLR2004
            continue
        first, second = colors_in(tuple(found[0].split()))
        rest = " . ".join([text[found.end() :], *(" ".join(one) for one in sentences[at + 1 :])]).strip(" .")
        other = _OTHER.search(rest)
        if other is None:
            continue
        object_ = f"the cube that is neither {first} nor {second}"
        rest = f"{rest[: other.start()]}{object_}{rest[other.end() :]}"
        if rest.startswith(f"{object_} . "):
            rest = rest.removeprefix(f"{object_} . ").replace(" it ", f" {object_} ", 1)
        return (*sentences[:at], *(tuple(one.split()) for one in rest.split(" . ")))
    return sentences
