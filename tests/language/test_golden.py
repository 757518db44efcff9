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
    ("PickXtimes", "explicit"): "cc044623ab9f5fb5",
    ("PickXtimes", "direct"): "a37bdc9c431d132c",
    ("PickXtimes", "reasoning"): "00f8a36c13ac4bce",
    ("PickXtimes", "contextual"): "924f39ad7e4767c7",
    ("PickXtimes", "spatial"): "8041d861456d2c04",
    ("StopCube", "explicit"): "9f3cd548d434c2e0",
    ("StopCube", "direct"): "ceb0d5ec8404f242",
    ("StopCube", "reasoning"): "a60d5f994c33827e",
    ("StopCube", "contextual"): "dbbe707230240535",
    ("SwingXtimes", "explicit"): "6dbdf439ea25f5f7",
    ("SwingXtimes", "direct"): "08ab0979dbe2ecdb",
    ("SwingXtimes", "reasoning"): "80cebc6e9827ba00",
    ("SwingXtimes", "contextual"): "79cb3443ea36f44d",
    ("SwingXtimes", "spatial"): "4dc1ac3ef6bfe8a6",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "7296131076b9f28a",
    ("BinFill", "reasoning"): "d69939dc446c7973",
    ("BinFill", "contextual"): "bf08f16f7af47618",
    ("BinFill", "spatial"): "d1667db5c40a7619",
    ("VideoUnmaskSwap", "explicit"): "17b77b49a5672d79",
    ("VideoUnmaskSwap", "direct"): "3b8694f04a0a0a59",
    ("VideoUnmaskSwap", "reasoning"): "e47b6d5efd078f72",
    ("VideoUnmaskSwap", "contextual"): "c48dd49500038a9b",
    ("VideoUnmaskSwap", "spatial"): "bfe9cece24c05964",
    ("VideoUnmask", "explicit"): "207a7890cb75eff2",
    ("VideoUnmask", "direct"): "68569fab4c1cc859",
    ("VideoUnmask", "reasoning"): "ed607a33cc42d1ea",
    ("VideoUnmask", "contextual"): "b6601376ed043a02",
    ("VideoUnmask", "spatial"): "6a24944cf91d0bde",
    ("ButtonUnmaskSwap", "explicit"): "3a327d549e065859",
    ("ButtonUnmaskSwap", "direct"): "3b5f0bb4822d4f6b",
    ("ButtonUnmaskSwap", "reasoning"): "a59869f4de44f35d",
    ("ButtonUnmaskSwap", "contextual"): "1104d8f8f11fc5cb",
    ("ButtonUnmaskSwap", "spatial"): "1328207b08faa8fd",
    ("ButtonUnmask", "explicit"): "95dae1eb218be5d8",
    ("ButtonUnmask", "direct"): "ba781e707d3dbfa2",
    ("ButtonUnmask", "reasoning"): "6fc6b796f259b4ba",
    ("ButtonUnmask", "contextual"): "3656f9c0612618b5",
    ("ButtonUnmask", "spatial"): "1b7469512882bde0",
    ("VideoRepick", "explicit"): "136577081975065b",
    ("VideoRepick", "direct"): "638992189392001b",
    ("VideoRepick", "reasoning"): "d7d59d65db0cb2dd",
    ("VideoRepick", "contextual"): "93082f98be6c5071",
    ("VideoPlaceButton", "explicit"): "8966e1428ae9206e",
    ("VideoPlaceButton", "direct"): "2aff130e34371ccd",
    ("VideoPlaceButton", "reasoning"): "72e9e9932aff11ba",
    ("VideoPlaceButton", "contextual"): "4991ae84df39fb71",
    ("VideoPlaceOrder", "explicit"): "ba8b253c824ef21b",
    ("VideoPlaceOrder", "direct"): "f60c8fb7803001c9",
    ("VideoPlaceOrder", "reasoning"): "d14ed0cf00190daf",
    ("VideoPlaceOrder", "contextual"): "8d2623362ab0bd27",
    ("PutInBox", "explicit"): "5f5f3195be4b1b6d",
    ("PutInBox", "direct"): "15babc90afc9b466",
    ("PutInBox", "reasoning"): "a42460f5be69be73",
    ("PutInBox", "contextual"): "c051395a9c32972f",
    ("PutInBox", "spatial"): "338e0c37aa7e20a3",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "ad5629cc2d22beab",
    ("PickByCount", "reasoning"): "cac0b4a5640ed40f",
    ("PickByCount", "contextual"): "ec4d6b35362e855b",
    ("PickByCount", "spatial"): "0954f6e48fe20945",
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
