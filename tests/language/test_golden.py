"""The words of a language version never change."""

import dataclasses
import hashlib

import pytest
from language_variants import PAIRS, first_episodes

from roboirg.core.instruction_options import DEFAULT_REASONING, DEFAULT_RIVAL
from roboirg.language import LANGUAGE_VERSION, instruct_with
from roboirg.language.variants import expressible_options

GOLDEN_VERSION = "1.1.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "18636767934deca2",
    ("PickXtimes", "direct"): "0aa8f8a8771d8dd8",
    ("PickXtimes", "reasoning"): "3fc4e01f26edf02d",
    ("PickXtimes", "contextual"): "ec0250acc6d8d20f",
    ("PickXtimes", "spatial"): "b363847cfc9232c0",
    ("StopCube", "explicit"): "d6a7aaf68c3cd5de",
    ("StopCube", "direct"): "7943d59eea5f9b07",
    ("StopCube", "reasoning"): "b177d1ac104a7dda",
    ("StopCube", "contextual"): "77943b6bbb84fad3",
    ("SwingXtimes", "explicit"): "60cebf9e2d98cbc0",
    ("SwingXtimes", "direct"): "ecf05a50c495149c",
    ("SwingXtimes", "reasoning"): "c3ae03ad0df5d6ef",
    ("SwingXtimes", "contextual"): "6187d522aa2f2913",
    ("SwingXtimes", "spatial"): "40d92f1666ce86f9",
    ("BinFill", "explicit"): "25f24857603693a8",
    ("BinFill", "direct"): "05c9465d59fdb87c",
    ("BinFill", "reasoning"): "d48b6003ebad6500",
    ("BinFill", "contextual"): "88a1f2eada378d01",
    ("BinFill", "spatial"): "92799a343d2bdf83",
    ("VideoUnmaskSwap", "explicit"): "8923dc8236673814",
    ("VideoUnmaskSwap", "direct"): "12fa2893ca3b85e1",
    ("VideoUnmaskSwap", "reasoning"): "216556f0e70b3208",
    ("VideoUnmaskSwap", "contextual"): "4331922d81a61602",
    ("VideoUnmaskSwap", "spatial"): "c564210df7b09c94",
    ("VideoUnmask", "explicit"): "ba6bb287ce39ef5e",
    ("VideoUnmask", "direct"): "28a37ea5c94711d6",
    ("VideoUnmask", "reasoning"): "b2618edfd48691b6",
    ("VideoUnmask", "contextual"): "be0c0346e78ed3cf",
    ("VideoUnmask", "spatial"): "1dd57e05d418a51d",
    ("ButtonUnmaskSwap", "explicit"): "83229163efca683a",
    ("ButtonUnmaskSwap", "direct"): "543f1af730296c67",
    ("ButtonUnmaskSwap", "reasoning"): "1af22918682b9fe9",
    ("ButtonUnmaskSwap", "contextual"): "6f397dbf7e07680d",
    ("ButtonUnmaskSwap", "spatial"): "8e45c1140d799829",
    ("ButtonUnmask", "explicit"): "b037c2ebca91799d",
    ("ButtonUnmask", "direct"): "e400a7dedc309b96",
    ("ButtonUnmask", "reasoning"): "4615f9be2febe994",
    ("ButtonUnmask", "contextual"): "bf6bd93148d01443",
    ("ButtonUnmask", "spatial"): "7a9b696d603164b9",
    ("VideoRepick", "explicit"): "e01bd111d668dd60",
    ("VideoRepick", "direct"): "1896aff08a62f5aa",
    ("VideoRepick", "reasoning"): "a7dbfc15271166bd",
    ("VideoRepick", "contextual"): "65d6a39101916d05",
    ("VideoPlaceButton", "explicit"): "fdfc2bc7fe23eff2",
    ("VideoPlaceButton", "direct"): "32c71992a309595b",
    ("VideoPlaceButton", "reasoning"): "7e48190f3b2981b1",
    ("VideoPlaceButton", "contextual"): "6687e86ba6ea446f",
    ("VideoPlaceOrder", "explicit"): "3d4b92e57dd8809e",
    ("VideoPlaceOrder", "direct"): "b920c37254fcfab2",
    ("VideoPlaceOrder", "reasoning"): "99aea58ae3e27eb1",
    ("VideoPlaceOrder", "contextual"): "dc95eb9088f46d83",
    ("PutInBox", "explicit"): "3fd0885e90a4cfc0",
    ("PutInBox", "direct"): "febbefc44b94fc7c",
    ("PutInBox", "reasoning"): "7d314f1ffc420395",
    ("PutInBox", "contextual"): "d1a9864128d131bb",
    ("PutInBox", "spatial"): "edc0e75078a8d781",
    ("PickByCount", "explicit"): "ec4788b904780424",
    ("PickByCount", "direct"): "61e993c68f26f9d1",
    ("PickByCount", "reasoning"): "90abfb6e5a36cfdb",
    ("PickByCount", "contextual"): "ba04eb8371c4f121",
    ("PickByCount", "spatial"): "a5d192ef9e5daf6d",
}


def digest(task, setting):
    """A hash of all instructions of the first 24 training episodes."""
    sha = hashlib.sha256()
    for episode in first_episodes(task, "train", 24):
        for options in expressible_options(episode):
            usual = (options.rival, options.reasoning) == (DEFAULT_RIVAL, DEFAULT_REASONING)
            if options.setting == setting and usual:
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
