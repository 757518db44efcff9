"""The words of a language version never change."""

import hashlib

import pytest
from language_variants import TASKS, first_episodes

from roboirg.language import LANGUAGE_VERSION, instruct_with
from roboirg.language.variants import expressible_options

GOLDEN_VERSION = "3.0.0"
GOLDEN: dict[str, str] = {
    "PickXtimes": "c3c00344c37963f4",
    "StopCube": "d689087999b3007c",
    "SwingXtimes": "fd42c020dfcb89ef",
    "BinFill": "a3e450588caff91b",
    "VideoUnmaskSwap": "b5b36fd905b7c96e",
    "VideoUnmask": "7779bb75f1ca6586",
    "ButtonUnmaskSwap": "6daf798c2a6fcfb8",
    "ButtonUnmask": "51ce49add1b32bd1",
    "VideoRepick": "754652e050acf1b0",
    "VideoPlaceButton": "70897df83d79cb59",
    "VideoPlaceOrder": "b1d923874868ee41",
    "PutInBox": "8ae0b86252e3f031",
    "PickByCount": "b191a0c98ba4d05f",
}


def digest(task):
    """A hash of all instructions, with all options, of the first episodes of train and of test."""
    sha = hashlib.sha256()
    for episode in (one for split in ("train", "test") for one in first_episodes(task, split, 8)):
        for options in expressible_options(episode):
            said = instruct_with(episode, options)
            told = (episode.key, options.setting, options.form, said.turns, said.mentions)
            sha.update(repr(told).encode())
    return sha.hexdigest()[:16]


@pytest.mark.parametrize("task", TASKS)
def test_the_words_are_those_of_the_version(task):
    assert LANGUAGE_VERSION == GOLDEN_VERSION, "new version: put its digests here"
    assert digest(task) == GOLDEN[task], (
        "The words (or the scenes) have changed: bump LANGUAGE_VERSION in "
        "roboirg/language/templates and put the new digests here."
    )
