"""Split text into sentences of lower-case words; look up numbers and colors."""

from __future__ import annotations

import re
from collections.abc import Iterable

Sentence = tuple[str, ...]
"""A sentence as its words, numbers and commas: ``("lift", "it", ",", "then", "press")``."""

# In this order: "2nd", "3.5", "don't", "42", punctuation, and any other sign that is no space.
_WORD = re.compile(
    r"[0-9]+(?:st|nd|rd|th)\b|[0-9]+[.][0-9]+|[^\W\d_]+(?:'[^\W\d_]+)?|[0-9]+|[,;:]|[^\W_]"
)
_SENTENCE_END = re.compile(r"(?:[.](?![0-9])|[!?\n])+")
"""Full stops and other ends of sentences, but not the point in *3.5*."""
_LIST_MARK = re.compile(r"(?:^|(?<=[.;:,\n]))\s*(?:step )?(?:[0-9][.):]|[-*•])\s+", re.MULTILINE)
"""*1.*, *2)*, *Step 3:* and the like, in front of the sentences of a plan."""
_MINUS = re.compile(r"(?<!\w)[-−](?=[0-9])")
"""The sign before a negative number; not a hyphen."""
_SPELLINGS = (
    ("’", "'"),
    ("->", " to "),
    ("→", " to "),
    (" + ", " and "),
    (" & ", " and "),
    ("(s)", "s"),
    ("cannot", "can not"),
    ("can't", "can not"),
    ("won't", "will not"),
    ("n't", " not"),
    ("'re ", " are "),
    ("'ve ", " have "),
    ("'ll ", " will "),
    ("'d ", " would "),
    ("i'm ", "i am "),
    ("it's ", "it is "),
    ("that's ", "that is "),
    ("what's ", "what is "),
    ("where's ", "where is "),
    ("colour", "color"),
    ("neighbour", "neighbor"),
    ("centre", "center"),
    ("grey", "gray"),
)

_NUMBERS = {
    "zero": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7,
    "eight": 8, "nine": 9, "ten": 10, "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14,
    "fifteen": 15, "sixteen": 16, "seventeen": 17, "eighteen": 18, "nineteen": 19, "twenty": 20,
}  # fmt: skip
ADVERBS = {"once": 1, "twice": 2, "thrice": 3}
"""Numbers of repetitions in one word."""
_ORDINALS = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5,
    "sixth": 6, "seventh": 7, "eighth": 8, "ninth": 9, "tenth": 10,
    "1st": 1, "2nd": 2, "3rd": 3, "4th": 4, "5th": 5,
    "6th": 6, "7th": 7, "8th": 8, "9th": 9, "10th": 10,
}  # fmt: skip
_COLOR_NAMES = ("red", "green", "blue", "yellow", "gray", "purple")
_COLORS = dict(zip(_COLOR_NAMES, _COLOR_NAMES, strict=True))
for _name in _COLOR_NAMES:
    _COLORS[f"{_name}s"] = _name


def word_set(words: str) -> frozenset[str]:
    """Return the words of a string as a set: ``"them these"`` gives ``{"them", "these"}``."""
    return frozenset(words.split())


SYNONYMS = {
    "block": "cube", "blocks": "cubes", "brick": "cube", "bricks": "cubes",
    "circle": "target", "circles": "targets", "disc": "target", "discs": "targets",
    "disk": "target", "disks": "targets", "pad": "target", "plate": "target",
    "trash": "bin", "bucket": "bin", "basket": "bin",
    "cup": "container", "cups": "containers", "lid": "container", "lids": "containers",
    "bowl": "container", "bowls": "containers",
    "movie": "video", "demo": "video", "clip": "video", "demonstration": "video",
    "recording": "video", "image": "picture", "photo": "picture", "repick": "pick",
    "till": "until", "furthest": "farthest", "center": "middle", "centermost": "middle",
    "central": "middle", "onto": "on", "upon": "on", "inside": "in", "into": "in",
    "immediately": "right",
}  # fmt: skip
"""Words that are read as others; `vocabulary.register_words` adds those of other packages."""

FILLERS = word_set(
    "please okay ok kindly carefully gently slowly quickly softly neatly calmly just simply only "
    "exactly precisely uh um er thanks safely firmly carefully successfully"
)
"""Words that change nothing in any position; `split_sentences` drops them."""

_LARGEST_NUMBER = 10**9
"""Stands for every number with more digits."""


def _alternatives(words: Iterable[str]) -> str:
    """Return a regular expression for any of these words: ``"seventh|seven"``.

    The longest comes first, as the regular expression takes the first alternative that fits.
    """
    return "|".join(sorted(words, key=len, reverse=True))


NUMBER = rf"(?:{_alternatives(_NUMBERS)}|[0-9]+)"
"""A regular expression for a cardinal number, in words or digits."""
ORDINAL = rf"(?:{_alternatives(_ORDINALS)})"
"""A regular expression for an ordinal number."""
COLOR = rf"(?:{_alternatives(_COLOR_NAMES)})"
"""A regular expression for a color."""


def split_sentences(text: str) -> tuple[Sentence, ...]:
    """Return the sentences of a text, each as a tuple of normalized words and commas.

    ``"Please lift the block. It's grey!"`` gives ``(("lift", "the", "cube"), ("it", "is",
    "gray"))``: words become lower case, fillers such as *please* are dropped, spelling variants and
    contractions are replaced by one form, and synonyms by one word.
    """
    text = _LIST_MARK.sub("\n", text.lower())
    # In the order of the table: "can't" must be replaced before "n't".
    for variant, usual in _SPELLINGS:
        text = text.replace(variant, usual)
    text = _MINUS.sub("minus ", text)
    sentences = []
    for part in _SENTENCE_END.split(text):
        words = [SYNONYMS.get(word, word) for word in _WORD.findall(part) if word not in FILLERS]
        if words:
            sentences.append(tuple(words))
    return tuple(sentences)


def number_of(word: str) -> int | None:
    """Return the number that a word or a string of digits names, such as *three* or *3*.

    None for any other word. Numbers of ten digits or more are cut to `_LARGEST_NUMBER`.
    """
    if word.isascii() and word.isdigit():
        return int(word) if len(word) < len(str(_LARGEST_NUMBER)) else _LARGEST_NUMBER
    return _NUMBERS.get(word)


def ordinal_of(word: str) -> int | None:
    """Return 1 for ``first``, 2 for ``second`` or ``2nd``, up to 10; None for any other word."""
    return _ORDINALS.get(word)


def color_of(word: str) -> str | None:
    """Return the color that a word names: ``"red"`` for *red* or *reds*; None for other words."""
    return _COLORS.get(word)
