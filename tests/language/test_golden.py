"""The words of a language version never change."""

import dataclasses
import hashlib
import itertools

import pytest
from language_variants import PAIRS, first_episodes

from roboirg.language import FORMS, LANGUAGE_VERSION, instruct_with
from roboirg.language.settings import all_settings
from roboirg.language.variants import expressible_options

GOLDEN_VERSION = "2.0.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "4d0c5a0ee1201935",
    ("PickXtimes", "direct"): "1b6c0e1a408effc5",
    ("PickXtimes", "reasoning"): "9e1d710d2895f26b",
    ("PickXtimes", "contextual"): "749360b328bf7b02",
    ("PickXtimes", "spatial"): "02a983439d6478cb",
    ("StopCube", "explicit"): "a59825cccb4e82a4",
    ("StopCube", "direct"): "d43b5a6ec56d2383",
    ("StopCube", "reasoning"): "e072b2d5c396ec3c",
    ("StopCube", "contextual"): "96a8502cfc418046",
    ("SwingXtimes", "explicit"): "cf012bd526ec61ee",
    ("SwingXtimes", "direct"): "66bc7e337abc48ec",
    ("SwingXtimes", "reasoning"): "307ed1f9f9594e4c",
    ("SwingXtimes", "contextual"): "42e2fbb1b990c0bb",
    ("SwingXtimes", "spatial"): "a8a573c85b2c522f",
    ("BinFill", "explicit"): "d360669d60f981b9",
    ("BinFill", "direct"): "5de98b53029d68ec",
    ("BinFill", "reasoning"): "30ce94d22d3f5d43",
    ("BinFill", "contextual"): "b72a8e2cf9050fa5",
    ("BinFill", "spatial"): "e15790198b121e60",
    ("VideoUnmaskSwap", "explicit"): "d3e297d86f734497",
    ("VideoUnmaskSwap", "direct"): "a0ff77f554bd4882",
    ("VideoUnmaskSwap", "reasoning"): "1e2ce7cd6d4acbe9",
    ("VideoUnmaskSwap", "contextual"): "12647d3692718198",
    ("VideoUnmaskSwap", "spatial"): "4785ad7e225f6f92",
    ("VideoUnmask", "explicit"): "f2cd46a0344d163f",
    ("VideoUnmask", "direct"): "d1cdead7cd56f34b",
    ("VideoUnmask", "reasoning"): "731d05fc84bc2ad4",
    ("VideoUnmask", "contextual"): "d4e63c094b1b8fe2",
    ("VideoUnmask", "spatial"): "d52d2f332dde6060",
    ("ButtonUnmaskSwap", "explicit"): "2eb0c67efd4f80d0",
    ("ButtonUnmaskSwap", "direct"): "b9a443036ed89a01",
    ("ButtonUnmaskSwap", "reasoning"): "3efad7db3aaffbf1",
    ("ButtonUnmaskSwap", "contextual"): "369314074fdbb2a9",
    ("ButtonUnmaskSwap", "spatial"): "11cb3199e9340724",
    ("ButtonUnmask", "explicit"): "64b2493e20e6c9cc",
    ("ButtonUnmask", "direct"): "bac8d0763fc40687",
    ("ButtonUnmask", "reasoning"): "68af1c5d39ca10a8",
    ("ButtonUnmask", "contextual"): "6434f10d7d4bf22c",
    ("ButtonUnmask", "spatial"): "9a0b4a9602a6e6b4",
    ("VideoRepick", "explicit"): "583227de4f0fc20a",
    ("VideoRepick", "direct"): "f1f9872d4e48c49e",
    ("VideoRepick", "reasoning"): "e463973cd34be86e",
    ("VideoRepick", "contextual"): "af2fc7f2aee5f3e5",
    ("VideoPlaceButton", "explicit"): "470071969ae2d6c3",
    ("VideoPlaceButton", "direct"): "ddeba4fd10a28eb4",
    ("VideoPlaceButton", "reasoning"): "6cd34f7f4ccc3115",
    ("VideoPlaceButton", "contextual"): "fc7a3514e9cf8a0d",
    ("VideoPlaceOrder", "explicit"): "9ee677f022d40e80",
    ("VideoPlaceOrder", "direct"): "f485b3cf509b859f",
    ("VideoPlaceOrder", "reasoning"): "9300951dc45042fd",
    ("VideoPlaceOrder", "contextual"): "2228a07a24ea1bc0",
    ("PutInBox", "explicit"): "6badcbe6653bf81e",
    ("PutInBox", "direct"): "2ade9ee820ea3276",
    ("PutInBox", "reasoning"): "71cadba1d49b9870",
    ("PutInBox", "contextual"): "a9f314dcfdaf749a",
    ("PutInBox", "spatial"): "5fd87d649659973a",
    ("PickByCount", "explicit"): "e6a7655da8691591",
    ("PickByCount", "direct"): "686198301b7dc84a",
    ("PickByCount", "reasoning"): "7a36cda2ffa8834c",
    ("PickByCount", "contextual"): "77100c723a35057d",
    ("PickByCount", "spatial"): "6a2e404e1b39200d",
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
