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
    ("PickXtimes", "reasoning"): "6e192963557cbd6a",
    ("PickXtimes", "contextual"): "12888bcd1bdcf8f6",
    ("PickXtimes", "spatial"): "c6b16abd8abc8f46",
    ("StopCube", "explicit"): "9f3cd548d434c2e0",
    ("StopCube", "direct"): "38c0c03a809a1e4e",
    ("StopCube", "reasoning"): "31e83442332216d1",
    ("StopCube", "contextual"): "29c80c27212c45ba",
    ("SwingXtimes", "explicit"): "48160a37e614a87b",
    ("SwingXtimes", "direct"): "3698105bee194069",
    ("SwingXtimes", "reasoning"): "2caab391f9d292c7",
    ("SwingXtimes", "contextual"): "4a0d1083814e47d7",
    ("SwingXtimes", "spatial"): "1104ab5e91d2c487",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "987089962d44f889",
    ("BinFill", "reasoning"): "9df4cde1d59b6650",
    ("BinFill", "contextual"): "b91242f9aba2f013",
    ("BinFill", "spatial"): "e70e58efdd825ea7",
    ("VideoUnmaskSwap", "explicit"): "3d4a1b3e4341e3be",
    ("VideoUnmaskSwap", "direct"): "595d6a911eb9fc42",
    ("VideoUnmaskSwap", "reasoning"): "c803a57f00ef4d01",
    ("VideoUnmaskSwap", "contextual"): "6b54a75ea81869f9",
    ("VideoUnmaskSwap", "spatial"): "075ae42384b99c21",
    ("VideoUnmask", "explicit"): "7a410b25364b0b31",
    ("VideoUnmask", "direct"): "553a72cb4d3b5c34",
    ("VideoUnmask", "reasoning"): "536c0e51742374a5",
    ("VideoUnmask", "contextual"): "986baf930018e4c8",
    ("VideoUnmask", "spatial"): "aefc93bb5a23f2e2",
    ("ButtonUnmaskSwap", "explicit"): "7b79b077f29df3bc",
    ("ButtonUnmaskSwap", "direct"): "20026aa35b8045d9",
    ("ButtonUnmaskSwap", "reasoning"): "4f4d0f027feb199b",
    ("ButtonUnmaskSwap", "contextual"): "0ba20255e5759398",
    ("ButtonUnmaskSwap", "spatial"): "3be657b29fa6588e",
    ("ButtonUnmask", "explicit"): "3cd702e30f94d5c9",
    ("ButtonUnmask", "direct"): "868dbcb51287494d",
    ("ButtonUnmask", "reasoning"): "ea6d23eb8d6ab9c1",
    ("ButtonUnmask", "contextual"): "dca58a28bc31b11e",
    ("ButtonUnmask", "spatial"): "f7ce9f89191790bc",
    ("VideoRepick", "explicit"): "2be5848ba3859f08",
    ("VideoRepick", "direct"): "8c1cd04107ca92a3",
    ("VideoRepick", "reasoning"): "89756902e4471642",
    ("VideoRepick", "contextual"): "aebaeb5ad2142bd4",
    ("VideoPlaceButton", "explicit"): "3e72fe7d06f6d56e",
    ("VideoPlaceButton", "direct"): "613b35fa8d2cea95",
    ("VideoPlaceButton", "reasoning"): "22d8d54f60185564",
    ("VideoPlaceButton", "contextual"): "c14ab3fb8c09ae08",
    ("VideoPlaceOrder", "explicit"): "3deb310aef7b3bb5",
    ("VideoPlaceOrder", "direct"): "ee9f2042439aff4e",
    ("VideoPlaceOrder", "reasoning"): "7d8e624bd811a12a",
    ("VideoPlaceOrder", "contextual"): "c81b485fdb1c7663",
    ("PutInBox", "explicit"): "5f5f3195be4b1b6d",
    ("PutInBox", "direct"): "1fde4528262bd603",
    ("PutInBox", "reasoning"): "88e1974523f631be",
    ("PutInBox", "contextual"): "65c8dc4746d38fc0",
    ("PutInBox", "spatial"): "b5f0b55f599229e9",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "106ce07d132b8d3d",
    ("PickByCount", "reasoning"): "458b1cc1915eeb58",
    ("PickByCount", "contextual"): "0a372db309a097a8",
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
