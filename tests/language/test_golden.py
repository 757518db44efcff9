"""The words of a language version never change."""

import hashlib

import pytest
from language_variants import PAIRS, options_of

from roboirg.language import FORMS, LANGUAGE_VERSION, expressible, instruct
from roboirg.splits import get_episode

GOLDEN_VERSION = "1.1.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "7660bcbba2968860",
    ("PickXtimes", "direct"): "80c4f4565f0ca64e",
    ("PickXtimes", "reasoning"): "5aac0eda7945823d",
    ("PickXtimes", "contextual"): "91325a2801c37694",
    ("PickXtimes", "spatial"): "f3979e732d077d38",
    ("VideoUnmask", "explicit"): "7b9ce982218780a8",
    ("VideoUnmask", "direct"): "011d360751b00eb0",
    ("VideoUnmask", "reasoning"): "cd3590ba6777ecc4",
    ("VideoUnmask", "contextual"): "8339af50b3911423",
    ("VideoUnmask", "spatial"): "51592a25c01c5673",
}


def digest(task, setting):
    """A hash of all that is said in the first 24 test episodes."""
    sha = hashlib.sha256()
    for index in range(24):
        episode = get_episode(task, "test", index)
        if setting not in expressible(episode):
            continue
        for form in FORMS:
            for options in options_of(setting, episode):
                instruction = instruct(episode, setting, form, **options)
                sha.update("\n".join((episode.key, form, *instruction.turns)).encode())
                sha.update(repr(instruction.mentions).encode())
    return sha.hexdigest()[:16]


@pytest.mark.parametrize(("task", "setting"), PAIRS)
def test_the_words_are_those_of_the_version(task, setting):
    assert LANGUAGE_VERSION == GOLDEN_VERSION, "new version: put its digests here"
    assert digest(task, setting) == GOLDEN[task, setting], (
        "The words (or the scenes) have changed: bump LANGUAGE_VERSION in "
        "roboirg/language/templates.py and put the new digests here."
    )
