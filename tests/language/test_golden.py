"""The words of a language version never change."""

import dataclasses
import hashlib

import pytest
from language_variants import PAIRS, random_episodes

from roboirg.language import LANGUAGE_VERSION, instruct_with
from roboirg.language.variants import expressible_options

GOLDEN_VERSION = "1.1.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "cf93cf9660944ced",
    ("PickXtimes", "direct"): "d6158c3376653471",
    ("PickXtimes", "reasoning"): "5cfb60449ece8b97",
    ("PickXtimes", "contextual"): "0c8683b7002a4b5c",
    ("PickXtimes", "spatial"): "caef1acb473f51f2",
    ("StopCube", "explicit"): "2e52218e0e2c0cd0",
    ("StopCube", "direct"): "f4b19c56187858cb",
    ("StopCube", "reasoning"): "49464ce5c9d45aaa",
    ("StopCube", "contextual"): "a7234fb54e5a7778",
    ("SwingXtimes", "explicit"): "5cf70ffd8b6c744a",
    ("SwingXtimes", "direct"): "76c5785103d93a19",
    ("SwingXtimes", "reasoning"): "f7c1b1f7b21d5a7e",
    ("SwingXtimes", "contextual"): "56de69c81b2a2643",
    ("SwingXtimes", "spatial"): "f350bc98434a254f",
    ("BinFill", "explicit"): "53b57d97cfc32ca5",
    ("BinFill", "direct"): "759738e46e643cb6",
    ("BinFill", "reasoning"): "d7d42fa30acf7597",
    ("BinFill", "contextual"): "08ea18f8e404ec58",
    ("BinFill", "spatial"): "a376c35407e451cb",
    ("VideoUnmaskSwap", "explicit"): "628bf420bdd1b0dd",
    ("VideoUnmaskSwap", "direct"): "5c6df1dbeddd7f74",
    ("VideoUnmaskSwap", "reasoning"): "ed824ced0033b9d3",
    ("VideoUnmaskSwap", "contextual"): "f8b67bbed61d556a",
    ("VideoUnmaskSwap", "spatial"): "3ec111dd7682c475",
    ("VideoUnmask", "explicit"): "cba0ac22ce0618a5",
    ("VideoUnmask", "direct"): "5d24df12f1d778e7",
    ("VideoUnmask", "reasoning"): "7832c0a7e570349a",
    ("VideoUnmask", "contextual"): "7158fdf54afb2462",
    ("VideoUnmask", "spatial"): "5dd01536c8b5a76a",
    ("ButtonUnmaskSwap", "explicit"): "28b656ab332745dc",
    ("ButtonUnmaskSwap", "direct"): "38eab7c4d965b3c1",
    ("ButtonUnmaskSwap", "reasoning"): "1ca4a00d0a86d61c",
    ("ButtonUnmaskSwap", "contextual"): "b00bcaf0ca321381",
    ("ButtonUnmaskSwap", "spatial"): "c2ee80f02f57eb08",
    ("ButtonUnmask", "explicit"): "e273597a35ab2dfb",
    ("ButtonUnmask", "direct"): "ae32633e87091c82",
    ("ButtonUnmask", "reasoning"): "ad0fc245874923bc",
    ("ButtonUnmask", "contextual"): "6563035d1e778484",
    ("ButtonUnmask", "spatial"): "72de3b03cf8bab64",
    ("VideoRepick", "explicit"): "96b38b19f5df6a9c",
    ("VideoRepick", "direct"): "fb16756f80df7143",
    ("VideoRepick", "reasoning"): "9554540dcd08494f",
    ("VideoRepick", "contextual"): "44563595ba09950f",
    ("VideoPlaceButton", "explicit"): "101f93c9496bc58f",
    ("VideoPlaceButton", "direct"): "0d8d15b7cf0ed975",
    ("VideoPlaceButton", "reasoning"): "bb9181d713a3ef4b",
    ("VideoPlaceButton", "contextual"): "ba2e1dc7b81e5b6b",
    ("VideoPlaceOrder", "explicit"): "314205b2c60c6583",
    ("VideoPlaceOrder", "direct"): "33b87776f21cb0df",
    ("VideoPlaceOrder", "reasoning"): "ec587e771beed5f5",
    ("VideoPlaceOrder", "contextual"): "c12c1dea75a7b128",
    ("PutInBox", "explicit"): "00cca44d2841dcf7",
    ("PutInBox", "direct"): "3d3fde3974828e5f",
    ("PutInBox", "reasoning"): "62144c683668fe79",
    ("PutInBox", "contextual"): "240005be99ddcacc",
    ("PutInBox", "spatial"): "c693ba792d32db26",
    ("PickByCount", "explicit"): "6347812ec84bd880",
    ("PickByCount", "direct"): "982e663eed1e6665",
    ("PickByCount", "reasoning"): "18dfd48382117d7b",
    ("PickByCount", "contextual"): "b28cea0e0da3cd6c",
    ("PickByCount", "spatial"): "e6ccb9a9f3b83a15",
}


def digest(task, setting):
    """A hash of all instructions of 24 episodes."""
    sha = hashlib.sha256()
    for episode in random_episodes(task, 24):
        for options in expressible_options(episode):
            if options.setting == setting:
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
