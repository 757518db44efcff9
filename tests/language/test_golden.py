"""The words of a language version never change."""

import hashlib

import pytest
from language_variants import TASKS, expressible_options, first_episodes

from roboirg.language import LANGUAGE_VERSION, instruct_with

VERSION_OF_DIGESTS = "4.7.0"
DIGESTS: dict[str, str] = {
    "PickXtimes": "8ce8590c3b9bf936",
    "StopCube": "ecbc7dfbb52a7d08",
    "SwingXtimes": "1af48e284c7ff049",
    "BinFill": "529cf8b4a4fe291d",
    "VideoUnmaskSwap": "8f0873e023d8c4b9",
    "VideoUnmask": "a4831bcbb803e7e5",
    "ButtonUnmaskSwap": "af0d828cdf13c083",
    "ButtonUnmask": "e430a23e3ded9383",
    "VideoRepick": "1dfffc63ead9bc75",
    "VideoPlaceButton": "2d4080cdff4551a0",
    "VideoPlaceOrder": "0c4a85d9c7b0bb3a",
    "PutInBox": "f14b96c7dae2578e",
    "PickByCount": "828bdc9006bf5157",
}


def digest_of_first_instructions(task):
    """Return a hash of the instructions of the first 8 episodes of train and of test.

    Each is said with all combinations of options. Hashed are its words and its mentions, the spans
    that stand for values of the goal.
    """
    sha = hashlib.sha256()
    for split in ("train", "test"):
        for episode in first_episodes(task, split, 8):
            for options in expressible_options(episode):
                said = instruct_with(episode, options)
                told = (episode.key, options.setting, options.form, said.turns, said.mentions)
                sha.update(repr(told).encode())
    return sha.hexdigest()[:16]


@pytest.mark.parametrize("task", TASKS)
def test_instructions_change_only_with_the_language_version(task):
    """A hash of a task's first instructions is compared with the one stored for this version.

    Published scores are comparable only if the same version always says the same words.
    """
    assert LANGUAGE_VERSION == VERSION_OF_DIGESTS, "new version: put its digests here"
    assert digest_of_first_instructions(task) == DIGESTS[task], (
        "The words (or the scenes) have changed: bump LANGUAGE_VERSION in "
        "roboirg/language/word_sampler.py and put the new digests here."
    )
