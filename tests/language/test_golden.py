"""The words of a language version never change."""

import dataclasses
import hashlib
import itertools

import pytest
from language_variants import PAIRS, first_episodes

from roboirg.language import FORMS, LANGUAGE_VERSION, instruct_with
from roboirg.language.settings import all_settings
from roboirg.language.variants import expressible_options

GOLDEN_VERSION = "3.0.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "ea70aaa2503dbe6d",
    ("PickXtimes", "direct"): "60f649138d8362c0",
    ("PickXtimes", "reasoning"): "167ab333f3723c60",
    ("PickXtimes", "contextual"): "ce28dc511da53a41",
    ("PickXtimes", "spatial"): "07f90130d7e95a53",
    ("StopCube", "explicit"): "9f3cd548d434c2e0",
    ("StopCube", "direct"): "38c0c03a809a1e4e",
    ("StopCube", "reasoning"): "fd930c4f69be3986",
    ("StopCube", "contextual"): "6f7924b6c7ce5a97",
    ("SwingXtimes", "explicit"): "48160a37e614a87b",
    ("SwingXtimes", "direct"): "3698105bee194069",
    ("SwingXtimes", "reasoning"): "3d698f54f048a310",
    ("SwingXtimes", "contextual"): "5e87d8928178f671",
    ("SwingXtimes", "spatial"): "944cb32ebbb8b609",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "987089962d44f889",
    ("BinFill", "reasoning"): "4985b2d3fa590be8",
    ("BinFill", "contextual"): "e045ca1cfa7f7fc6",
    ("BinFill", "spatial"): "f0f2af444acca682",
    ("VideoUnmaskSwap", "explicit"): "3d4a1b3e4341e3be",
    ("VideoUnmaskSwap", "direct"): "595d6a911eb9fc42",
    ("VideoUnmaskSwap", "reasoning"): "18ef223ff5d3fc3d",
    ("VideoUnmaskSwap", "contextual"): "c858329fe14c477d",
    ("VideoUnmaskSwap", "spatial"): "a709fe27eea1fc5b",
    ("VideoUnmask", "explicit"): "7a410b25364b0b31",
    ("VideoUnmask", "direct"): "553a72cb4d3b5c34",
    ("VideoUnmask", "reasoning"): "ddc5eb60c636eeaa",
    ("VideoUnmask", "contextual"): "05f1d6bfe2e1dea1",
    ("VideoUnmask", "spatial"): "ec0dd517b09e5dd3",
    ("ButtonUnmaskSwap", "explicit"): "7b79b077f29df3bc",
    ("ButtonUnmaskSwap", "direct"): "20026aa35b8045d9",
    ("ButtonUnmaskSwap", "reasoning"): "bd3117493a1d35ab",
    ("ButtonUnmaskSwap", "contextual"): "98807291b2171369",
    ("ButtonUnmaskSwap", "spatial"): "4c29098b1c8df909",
    ("ButtonUnmask", "explicit"): "3cd702e30f94d5c9",
    ("ButtonUnmask", "direct"): "868dbcb51287494d",
    ("ButtonUnmask", "reasoning"): "61df3eb6b9454c96",
    ("ButtonUnmask", "contextual"): "05507811b76a2599",
    ("ButtonUnmask", "spatial"): "8f5fd9743159ca96",
    ("VideoRepick", "explicit"): "2be5848ba3859f08",
    ("VideoRepick", "direct"): "8c1cd04107ca92a3",
    ("VideoRepick", "reasoning"): "e8143ce70a3d744b",
    ("VideoRepick", "contextual"): "852d393776a760f7",
    ("VideoPlaceButton", "explicit"): "3e72fe7d06f6d56e",
    ("VideoPlaceButton", "direct"): "613b35fa8d2cea95",
    ("VideoPlaceButton", "reasoning"): "747cab35f7b97b46",
    ("VideoPlaceButton", "contextual"): "0ce01e1c2cc5c71f",
    ("VideoPlaceOrder", "explicit"): "3deb310aef7b3bb5",
    ("VideoPlaceOrder", "direct"): "ee9f2042439aff4e",
    ("VideoPlaceOrder", "reasoning"): "39ccdabf27be69ce",
    ("VideoPlaceOrder", "contextual"): "82f8ef49b5068dc3",
    ("PutInBox", "explicit"): "5f5f3195be4b1b6d",
    ("PutInBox", "direct"): "1fde4528262bd603",
    ("PutInBox", "reasoning"): "88e1974523f631be",
    ("PutInBox", "contextual"): "cf2875507e266d25",
    ("PutInBox", "spatial"): "18cd7db4869e6e02",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "106ce07d132b8d3d",
    ("PickByCount", "reasoning"): "7e202933f4f5d027",
    ("PickByCount", "contextual"): "dc3df72197ec746a",
    ("PickByCount", "spatial"): "ef3afa31ee9d1c93",
}


def digest(task, setting):
    """A hash of all instructions of the first 24 episodes of train and of test.

    Those of a setting's harder one are included.
    """
    sha = hashlib.sha256()
    kinds = {name for name, one in all_settings().items() if setting in (name, one.plain)}
    for episode in (one for split in ("train", "test") for one in first_episodes(task, split, 24)):
        for form, options in itertools.product(FORMS, list(expressible_options(episode))):
            if options.form == form and options.setting in kinds:
                instruction = instruct_with(episode, options)
                sha.update("\n".join((episode.key, options.form, *instruction.turns)).encode())
                sha.update(
                    repr([dataclasses.astuple(one) for one in instruction.mentions]).encode()
                )
    return sha.hexdigest()[:16]


@pytest.mark.parametrize(("task", "setting"), PAIRS)
def test_the_words_are_those_of_the_version(task, setting):
    assert LANGUAGE_VERSION == GOLDEN_VERSION, "new version: put its digests here"
    assert digest(task, setting) == GOLDEN[task, setting], (
        "The words (or the scenes) have changed: bump LANGUAGE_VERSION in "
        "roboirg/language/templates and put the new digests here."
    )
