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
    ("PickXtimes", "direct"): "9ad1d45ef3d2a096",
    ("PickXtimes", "reasoning"): "0d5cabe19f5e0a55",
    ("PickXtimes", "contextual"): "01cdfbee7a582ac3",
    ("PickXtimes", "spatial"): "c6b16abd8abc8f46",
    ("StopCube", "explicit"): "9f3cd548d434c2e0",
    ("StopCube", "direct"): "38c0c03a809a1e4e",
    ("StopCube", "reasoning"): "9d69a289fa290292",
    ("StopCube", "contextual"): "25380912b85db771",
    ("SwingXtimes", "explicit"): "6e71e11fe99a7d18",
    ("SwingXtimes", "direct"): "73617f8bbfc197c3",
    ("SwingXtimes", "reasoning"): "873cb26b371ccdca",
    ("SwingXtimes", "contextual"): "4389b8888d4ba31d",
    ("SwingXtimes", "spatial"): "3fbe79c8965e850b",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "230df1357cf30ca5",
    ("BinFill", "reasoning"): "f530c51428ac524e",
    ("BinFill", "contextual"): "c7ecb5319a83d427",
    ("BinFill", "spatial"): "e70e58efdd825ea7",
    ("VideoUnmaskSwap", "explicit"): "de013b1341bef433",
    ("VideoUnmaskSwap", "direct"): "25fda585497c65ed",
    ("VideoUnmaskSwap", "reasoning"): "9be24ce224aa6986",
    ("VideoUnmaskSwap", "contextual"): "c127e988d6e3bce4",
    ("VideoUnmaskSwap", "spatial"): "aeb0096c065fed55",
    ("VideoUnmask", "explicit"): "2d0ef3b748a40caa",
    ("VideoUnmask", "direct"): "8a163af5be0af150",
    ("VideoUnmask", "reasoning"): "58a3c39fe389a038",
    ("VideoUnmask", "contextual"): "2988888e5292bf41",
    ("VideoUnmask", "spatial"): "d96a39158d51a798",
    ("ButtonUnmaskSwap", "explicit"): "8ee9db363984effe",
    ("ButtonUnmaskSwap", "direct"): "e179ebcc1de08e76",
    ("ButtonUnmaskSwap", "reasoning"): "ca37ee50f7e6ba44",
    ("ButtonUnmaskSwap", "contextual"): "2703ed0617514fdb",
    ("ButtonUnmaskSwap", "spatial"): "b2104142fc358422",
    ("ButtonUnmask", "explicit"): "3cd702e30f94d5c9",
    ("ButtonUnmask", "direct"): "57e8d7aed480238d",
    ("ButtonUnmask", "reasoning"): "ea6d23eb8d6ab9c1",
    ("ButtonUnmask", "contextual"): "73997f0db3d5b243",
    ("ButtonUnmask", "spatial"): "f7ce9f89191790bc",
    ("VideoRepick", "explicit"): "2be5848ba3859f08",
    ("VideoRepick", "direct"): "dcf94c1a17397cdd",
    ("VideoRepick", "reasoning"): "fee3a7b6bc4e1a4c",
    ("VideoRepick", "contextual"): "bc1bd856c471ec38",
    ("VideoPlaceButton", "explicit"): "3e72fe7d06f6d56e",
    ("VideoPlaceButton", "direct"): "100560a5c5156bb8",
    ("VideoPlaceButton", "reasoning"): "22d8d54f60185564",
    ("VideoPlaceButton", "contextual"): "e9c304afccadd89f",
    ("VideoPlaceOrder", "explicit"): "3deb310aef7b3bb5",
    ("VideoPlaceOrder", "direct"): "ca67ae83d681d56a",
    ("VideoPlaceOrder", "reasoning"): "ab85600e1a2f5fdf",
    ("VideoPlaceOrder", "contextual"): "69fcf42deb79fabd",
    ("PutInBox", "explicit"): "5f5f3195be4b1b6d",
    ("PutInBox", "direct"): "a00f08bc6b7fcf16",
    ("PutInBox", "reasoning"): "88e1974523f631be",
    ("PutInBox", "contextual"): "8d0f707f09b398fc",
    ("PutInBox", "spatial"): "b5f0b55f599229e9",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "172709607f2a2fc1",
    ("PickByCount", "reasoning"): "0693c8cfd1af9cd9",
    ("PickByCount", "contextual"): "aa9dfc7df04f2c92",
    ("PickByCount", "spatial"): "09128cafdda43fc3",
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
