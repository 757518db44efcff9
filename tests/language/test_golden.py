"""The words of a language version never change."""

import dataclasses
import hashlib
import itertools

import pytest
from language_variants import PAIRS, first_episodes

from roboirg.language import FORMS, LANGUAGE_VERSION, instruct_with
from roboirg.language.settings import all_settings
from roboirg.language.variants import expressible_options

GOLDEN_VERSION = "2.1.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "f7082480e3d5fd69",
    ("PickXtimes", "direct"): "b8982580982d9e46",
    ("PickXtimes", "reasoning"): "a8131b814dc52c2e",
    ("PickXtimes", "contextual"): "0e3b8ab6e5463aca",
    ("PickXtimes", "spatial"): "c71b0967ad40d5d9",
    ("StopCube", "explicit"): "943abfaa12c3c5f9",
    ("StopCube", "direct"): "9c15a75f8437db0e",
    ("StopCube", "reasoning"): "67b5c0b3448c3f8f",
    ("StopCube", "contextual"): "c64d5e71fcd5b39f",
    ("SwingXtimes", "explicit"): "6dbdf439ea25f5f7",
    ("SwingXtimes", "direct"): "487dce74a3989cce",
    ("SwingXtimes", "reasoning"): "f6acf7229a1c402c",
    ("SwingXtimes", "contextual"): "d6326d47b2cd26bf",
    ("SwingXtimes", "spatial"): "5ca3e9b1a465d2b3",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "c60127e8565d6b7c",
    ("BinFill", "reasoning"): "182ca635e2c59933",
    ("BinFill", "contextual"): "333a36ddf86f8917",
    ("BinFill", "spatial"): "9ba1fa73f63f8b23",
    ("VideoUnmaskSwap", "explicit"): "fd5355075ba236b3",
    ("VideoUnmaskSwap", "direct"): "0c80d67e04643d54",
    ("VideoUnmaskSwap", "reasoning"): "e0018be04fda0be3",
    ("VideoUnmaskSwap", "contextual"): "658f0fe95db0c6c9",
    ("VideoUnmaskSwap", "spatial"): "1f72841a4809c376",
    ("VideoUnmask", "explicit"): "207a7890cb75eff2",
    ("VideoUnmask", "direct"): "942d94e62ebc0692",
    ("VideoUnmask", "reasoning"): "c7a81a7b1351fd2e",
    ("VideoUnmask", "contextual"): "efc263ba9f490b92",
    ("VideoUnmask", "spatial"): "ec716df1e4cabfed",
    ("ButtonUnmaskSwap", "explicit"): "123df512046e9154",
    ("ButtonUnmaskSwap", "direct"): "66a1a5db7395e4fc",
    ("ButtonUnmaskSwap", "reasoning"): "17a9b1ac504bdaf5",
    ("ButtonUnmaskSwap", "contextual"): "ed3e21ca7d6f94c3",
    ("ButtonUnmaskSwap", "spatial"): "4cf8f4d25c24c711",
    ("ButtonUnmask", "explicit"): "d000a20d20bf73a4",
    ("ButtonUnmask", "direct"): "972051e34a2c51fd",
    ("ButtonUnmask", "reasoning"): "1f7bba12a07c5c9a",
    ("ButtonUnmask", "contextual"): "97c88cfe6cbda32d",
    ("ButtonUnmask", "spatial"): "2b87602f40590324",
    ("VideoRepick", "explicit"): "136577081975065b",
    ("VideoRepick", "direct"): "fcdf097a97673a53",
    ("VideoRepick", "reasoning"): "1b40d1e5ebd72cdc",
    ("VideoRepick", "contextual"): "a2cffccd91e32a10",
    ("VideoPlaceButton", "explicit"): "8966e1428ae9206e",
    ("VideoPlaceButton", "direct"): "510bb4cf2664aee9",
    ("VideoPlaceButton", "reasoning"): "e2d7a64e484f3c66",
    ("VideoPlaceButton", "contextual"): "b4ac62c449496f16",
    ("VideoPlaceOrder", "explicit"): "ba8b253c824ef21b",
    ("VideoPlaceOrder", "direct"): "adce068bb3975b16",
    ("VideoPlaceOrder", "reasoning"): "9f62e22850ec6fa8",
    ("VideoPlaceOrder", "contextual"): "cd14f44aa28d7041",
    ("PutInBox", "explicit"): "1c6aec4ab61fc659",
    ("PutInBox", "direct"): "f6d7eb39a405425a",
    ("PutInBox", "reasoning"): "3589db0e73b1f8be",
    ("PutInBox", "contextual"): "15e8daafc37372bf",
    ("PutInBox", "spatial"): "d01ccbd41b664f22",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "76321af4835d0746",
    ("PickByCount", "reasoning"): "bef207727eda9db2",
    ("PickByCount", "contextual"): "3f3948452fc80537",
    ("PickByCount", "spatial"): "94a38e2a2eb63591",
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
        "roboirg/language/templates.py and put the new digests here."
    )
