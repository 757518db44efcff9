"""The words of a language version never change."""

import hashlib

import pytest
from language_variants import PAIRS, options_of

from roboirg.language import FORMS, LANGUAGE_VERSION, expressible, instruct
from roboirg.splits import get_episode

GOLDEN_VERSION = "1.0.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "f989e5a11f2b49e2",
    ("PickXtimes", "direct"): "ea4d7319aa90fcbe",
    ("PickXtimes", "reasoning"): "0707f0defd0b147b",
    ("PickXtimes", "contextual"): "fbf5b00dd4e54656",
    ("PickXtimes", "spatial"): "97d469d65e98a593",
    ("VideoUnmask", "explicit"): "e5fa41c98b9e25ba",
    ("VideoUnmask", "direct"): "32c8afe733306a06",
    ("VideoUnmask", "reasoning"): "ba65cd3ec5db4c72",
    ("VideoUnmask", "contextual"): "764bcbf8e3e0acfb",
    ("VideoUnmask", "spatial"): "c984b925f0b92fac",
}


def digest(task, setting):
    """A hash of all that is said in the first 24 test episodes."""
    sha = hashlib.sha256()
    for index in range(24):
        episode = get_episode(task, "test", index)
        if setting not in expressible(episode):
            continue
        for form in FORMS:
            for options in options_of(setting):
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
