"""The words of a language version never change."""

import hashlib

import pytest
from language_variants import PAIRS, random_episodes

from roboirg.language import LANGUAGE_VERSION, expressible
from roboirg.language.variants import tellings

GOLDEN_VERSION = "1.1.0"
GOLDEN: dict[tuple[str, str], str] = {
    ("PickXtimes", "explicit"): "7ebbd67f5bb9952c",
    ("PickXtimes", "direct"): "84c06f891e9aca3f",
    ("PickXtimes", "reasoning"): "5ed651faecadd11e",
    ("PickXtimes", "contextual"): "d691c914fbc6340e",
    ("PickXtimes", "spatial"): "9d28c0d79a594f0c",
    ("StopCube", "explicit"): "4e564704c61e9bb8",
    ("StopCube", "direct"): "8efe7211c74732c9",
    ("StopCube", "reasoning"): "a75b7c898d5194f9",
    ("StopCube", "contextual"): "c238de25dd14386f",
    ("SwingXtimes", "explicit"): "0e8cd731393c0e32",
    ("SwingXtimes", "direct"): "a10bb84302532826",
    ("SwingXtimes", "reasoning"): "2451397fae19b5f5",
    ("SwingXtimes", "contextual"): "158d3884f782dad3",
    ("SwingXtimes", "spatial"): "3f5c44f1e89b468f",
    ("BinFill", "explicit"): "a44e3dea8233dc8f",
    ("BinFill", "direct"): "b1088b31005a3abc",
    ("BinFill", "reasoning"): "9dec39c0fd7834fe",
    ("BinFill", "contextual"): "4b1f493b62d6cb8a",
    ("BinFill", "spatial"): "9c6768cd310e35db",
    ("VideoUnmaskSwap", "explicit"): "213166a43047cb39",
    ("VideoUnmaskSwap", "direct"): "fb8e2cfcc3313632",
    ("VideoUnmaskSwap", "reasoning"): "d8c8f8a2446921e7",
    ("VideoUnmaskSwap", "contextual"): "8057ccf00564e233",
    ("VideoUnmaskSwap", "spatial"): "0cc9b19b6d8ba361",
    ("VideoUnmask", "explicit"): "5a67b626dfeb1aae",
    ("VideoUnmask", "direct"): "d67da9c0f213b65b",
    ("VideoUnmask", "reasoning"): "5930168db341c1ba",
    ("VideoUnmask", "contextual"): "9a100b8df2728e79",
    ("VideoUnmask", "spatial"): "cec7f153af2d05fa",
    ("ButtonUnmaskSwap", "explicit"): "d2d122b784161935",
    ("ButtonUnmaskSwap", "direct"): "102cf9dae8ceab68",
    ("ButtonUnmaskSwap", "reasoning"): "4de8d127fe5fed74",
    ("ButtonUnmaskSwap", "contextual"): "3d44f8dc18eb6375",
    ("ButtonUnmaskSwap", "spatial"): "2adedb6fe612ccee",
    ("ButtonUnmask", "explicit"): "d8193a56ba9b360d",
    ("ButtonUnmask", "direct"): "9480a98f6caebbbe",
    ("ButtonUnmask", "reasoning"): "0cb4d517a2df69d5",
    ("ButtonUnmask", "contextual"): "eb74b7faf5c3bf1b",
    ("ButtonUnmask", "spatial"): "1fb4a6607785e440",
    ("VideoRepick", "explicit"): "2af2205635f6de08",
    ("VideoRepick", "direct"): "be3edd810551b301",
    ("VideoRepick", "reasoning"): "df9f0fb506b96eea",
    ("VideoRepick", "contextual"): "69c71378f0a0d09f",
    ("VideoPlaceButton", "explicit"): "1de4f2ed629d51fd",
    ("VideoPlaceButton", "direct"): "4e42acd57d2502ab",
    ("VideoPlaceButton", "reasoning"): "508c9c2598f846cf",
    ("VideoPlaceButton", "contextual"): "783127686c30000d",
    ("VideoPlaceOrder", "explicit"): "4968d57df08673de",
    ("VideoPlaceOrder", "direct"): "9dc2c12d648bad14",
    ("VideoPlaceOrder", "reasoning"): "94ffdef0ae12c6fa",
    ("VideoPlaceOrder", "contextual"): "4cb73e0566d69249",
    ("PutInBox", "explicit"): "04d5e1525b55b35c",
    ("PutInBox", "direct"): "f4da66c718c2d848",
    ("PutInBox", "reasoning"): "dd6e73da07147435",
    ("PutInBox", "contextual"): "170c32f64a4d1dd1",
    ("PutInBox", "spatial"): "661444c9a9f6d563",
    ("PickByCount", "explicit"): "1560ac35cb100ea1",
    ("PickByCount", "direct"): "985ad5e9154dfb46",
    ("PickByCount", "reasoning"): "987bbf8549466ee4",
    ("PickByCount", "contextual"): "d2acdfc76968060d",
    ("PickByCount", "spatial"): "2d0720a1065b84d4",
}


def digest(task, setting):
    """A hash of all that is said in 24 episodes."""
    sha = hashlib.sha256()
    for episode in random_episodes(task, 24):
        if setting not in expressible(episode):
            continue
        for telling in tellings(episode):
            if telling.setting == setting:
                instruction = telling.of(episode)
                sha.update("\n".join((episode.key, telling.form, *instruction.turns)).encode())
                sha.update(repr(instruction.mentions).encode())
    return sha.hexdigest()[:16]


@pytest.mark.parametrize(("task", "setting"), PAIRS)
def test_the_words_are_those_of_the_version(task, setting):
    assert LANGUAGE_VERSION == GOLDEN_VERSION, "new version: put its digests here"
    assert digest(task, setting) == GOLDEN[task, setting], (
        "The words (or the scenes) have changed: bump LANGUAGE_VERSION in "
        "roboirg/language/templates.py and put the new digests here."
    )
