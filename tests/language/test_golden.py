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
    ("PickXtimes", "explicit"): "f7082480e3d5fd69",
    ("PickXtimes", "direct"): "d2382caf104936b9",
    ("PickXtimes", "reasoning"): "61116f6625ad3368",
    ("PickXtimes", "contextual"): "db1405f00de88b74",
    ("PickXtimes", "spatial"): "30cc81334be22ebb",
    ("StopCube", "explicit"): "9f3cd548d434c2e0",
    ("StopCube", "direct"): "cc7061cd40aaebb0",
    ("StopCube", "reasoning"): "a60d5f994c33827e",
    ("StopCube", "contextual"): "4c7f190e264c63a9",
    ("SwingXtimes", "explicit"): "6dbdf439ea25f5f7",
    ("SwingXtimes", "direct"): "b1422e72595efc7d",
    ("SwingXtimes", "reasoning"): "6f58721eb236f25b",
    ("SwingXtimes", "contextual"): "ea70afda5de179f2",
    ("SwingXtimes", "spatial"): "016760c6af64fb54",
    ("BinFill", "explicit"): "8229b9be050378b7",
    ("BinFill", "direct"): "83ec933f8ccf0fbf",
    ("BinFill", "reasoning"): "f3654de35d766e50",
    ("BinFill", "contextual"): "dcb116ccfefe5cc3",
    ("BinFill", "spatial"): "d99cae58b2668c4e",
    ("VideoUnmaskSwap", "explicit"): "fd5355075ba236b3",
    ("VideoUnmaskSwap", "direct"): "bb9798645989c251",
    ("VideoUnmaskSwap", "reasoning"): "e0721b054ef6844f",
    ("VideoUnmaskSwap", "contextual"): "06d598cc52062e39",
    ("VideoUnmaskSwap", "spatial"): "0ee9e2f140827c10",
    ("VideoUnmask", "explicit"): "207a7890cb75eff2",
    ("VideoUnmask", "direct"): "dbda58432bc7628e",
    ("VideoUnmask", "reasoning"): "aefab741b6bd6ba8",
    ("VideoUnmask", "contextual"): "1262e9061b4f5e1d",
    ("VideoUnmask", "spatial"): "b9e32adfd34dc97f",
    ("ButtonUnmaskSwap", "explicit"): "3a327d549e065859",
    ("ButtonUnmaskSwap", "direct"): "e4b0e9c877db66db",
    ("ButtonUnmaskSwap", "reasoning"): "a4eedd83483c9b28",
    ("ButtonUnmaskSwap", "contextual"): "36f30d30bd663479",
    ("ButtonUnmaskSwap", "spatial"): "bed132d601fb1db2",
    ("ButtonUnmask", "explicit"): "95dae1eb218be5d8",
    ("ButtonUnmask", "direct"): "692033d6d5849bf2",
    ("ButtonUnmask", "reasoning"): "a38c3cac2f01c76b",
    ("ButtonUnmask", "contextual"): "df389a90b03ad98a",
    ("ButtonUnmask", "spatial"): "dabeecd4a85a20aa",
    ("VideoRepick", "explicit"): "136577081975065b",
    ("VideoRepick", "direct"): "5cb93ad42a4d93b8",
    ("VideoRepick", "reasoning"): "d7d59d65db0cb2dd",
    ("VideoRepick", "contextual"): "c8847a44e94050cc",
    ("VideoPlaceButton", "explicit"): "8966e1428ae9206e",
    ("VideoPlaceButton", "direct"): "e4fac9b78055bf6f",
    ("VideoPlaceButton", "reasoning"): "a7c8465d50e2fd01",
    ("VideoPlaceButton", "contextual"): "20c93bfc3bc13386",
    ("VideoPlaceOrder", "explicit"): "ba8b253c824ef21b",
    ("VideoPlaceOrder", "direct"): "39ab392767533714",
    ("VideoPlaceOrder", "reasoning"): "7763d7471388c00c",
    ("VideoPlaceOrder", "contextual"): "b1cdcce62f0f465d",
    ("PutInBox", "explicit"): "5f5f3195be4b1b6d",
    ("PutInBox", "direct"): "865a5f9ecc634750",
    ("PutInBox", "reasoning"): "65dcc003f2dbbca5",
    ("PutInBox", "contextual"): "a6592e01455709a6",
    ("PutInBox", "spatial"): "8da8bcb219de4ab8",
    ("PickByCount", "explicit"): "6284d1f6662f833c",
    ("PickByCount", "direct"): "69e7557b01f0c49e",
    ("PickByCount", "reasoning"): "ddecdf5071745562",
    ("PickByCount", "contextual"): "7ae9cbc4a1fd90fb",
    ("PickByCount", "spatial"): "9704d19ac0d8cc9f",
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
