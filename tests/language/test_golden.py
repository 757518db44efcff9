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
    ("PickXtimes", "direct"): "44e30e95950a7bbb",
    ("PickXtimes", "reasoning"): "a68118cb92d0cdb2",
    ("PickXtimes", "contextual"): "28e80a24ceb29f87",
    ("PickXtimes", "spatial"): "7ef9ed9e7074237f",
    ("StopCube", "explicit"): "9f3cd548d434c2e0",
    ("StopCube", "direct"): "35c08a3f2031f166",
    ("StopCube", "reasoning"): "5c08d7af8433d5e9",
    ("StopCube", "contextual"): "94022acaf3533ef8",
    ("SwingXtimes", "explicit"): "48160a37e614a87b",
    ("SwingXtimes", "direct"): "8ed6ba48a8a3a243",
    ("SwingXtimes", "reasoning"): "57d9514c4f0853a6",
    ("SwingXtimes", "contextual"): "2e375452d22e5f3a",
    ("SwingXtimes", "spatial"): "c7631e0effa797ee",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "f55b26f28f0aef41",
    ("BinFill", "reasoning"): "3751421b1fb4d206",
    ("BinFill", "contextual"): "115b1c6aa46e594f",
    ("BinFill", "spatial"): "cd581edf0408c981",
    ("VideoUnmaskSwap", "explicit"): "3d4a1b3e4341e3be",
    ("VideoUnmaskSwap", "direct"): "21d0d80a2a964ff6",
    ("VideoUnmaskSwap", "reasoning"): "0237b281f900764a",
    ("VideoUnmaskSwap", "contextual"): "018d680b351b8b92",
    ("VideoUnmaskSwap", "spatial"): "1daba260832ac162",
    ("VideoUnmask", "explicit"): "7a410b25364b0b31",
    ("VideoUnmask", "direct"): "142a59508e502d76",
    ("VideoUnmask", "reasoning"): "0266ac73f2961382",
    ("VideoUnmask", "contextual"): "b092c8de573dff59",
    ("VideoUnmask", "spatial"): "1ccdc6f36af88e06",
    ("ButtonUnmaskSwap", "explicit"): "7b79b077f29df3bc",
    ("ButtonUnmaskSwap", "direct"): "93cb94ac61cc19e6",
    ("ButtonUnmaskSwap", "reasoning"): "b1ce529c17652b79",
    ("ButtonUnmaskSwap", "contextual"): "7e202c0042f2cbd4",
    ("ButtonUnmaskSwap", "spatial"): "8234f6b649d376c8",
    ("ButtonUnmask", "explicit"): "3cd702e30f94d5c9",
    ("ButtonUnmask", "direct"): "d1116ef876f709e9",
    ("ButtonUnmask", "reasoning"): "73843bc8cbc49601",
    ("ButtonUnmask", "contextual"): "81012c73f10ad984",
    ("ButtonUnmask", "spatial"): "2a78ae5c7fd7a1b1",
    ("VideoRepick", "explicit"): "2be5848ba3859f08",
    ("VideoRepick", "direct"): "807783fdb112816c",
    ("VideoRepick", "reasoning"): "89756902e4471642",
    ("VideoRepick", "contextual"): "7b6c8705abfe860e",
    ("VideoPlaceButton", "explicit"): "3e72fe7d06f6d56e",
    ("VideoPlaceButton", "direct"): "c3cbf28896a68b3b",
    ("VideoPlaceButton", "reasoning"): "defa32b51f46e28c",
    ("VideoPlaceButton", "contextual"): "c79d29a88d7db1f4",
    ("VideoPlaceOrder", "explicit"): "3deb310aef7b3bb5",
    ("VideoPlaceOrder", "direct"): "8d219f657183daaa",
    ("VideoPlaceOrder", "reasoning"): "7a1b1997f0cf25ce",
    ("VideoPlaceOrder", "contextual"): "813019a7dd718775",
    ("PutInBox", "explicit"): "5f5f3195be4b1b6d",
    ("PutInBox", "direct"): "a52eeee2acc8ca7b",
    ("PutInBox", "reasoning"): "f4ffc07cc9dc2294",
    ("PutInBox", "contextual"): "ac99422178f3cf6c",
    ("PutInBox", "spatial"): "95e8f44abfdf8dc6",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "c1db85e5a961aab7",
    ("PickByCount", "reasoning"): "7fe0129770f5cf57",
    ("PickByCount", "contextual"): "381c4d747f801d78",
    ("PickByCount", "spatial"): "f5241a0a06f78451",
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
