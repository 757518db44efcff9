"""What a policy declares and reports as records have it, and made-up episodes to try it with."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from roboirg.core.observations import CAMERAS
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.policies.contract.json_values import as_json
from roboirg.policies.contract.policy_version import read_version
from roboirg.policies.contract.synthetic_episodes import SyntheticEpisodes


@pytest.mark.parametrize(
    ("value", "stored"),
    [
        (2**63 - 1, 2**63 - 1),
        (1 - 2**63, 1 - 2**63),
        (2**63, "9223372036854775808"),
        (Path("a/b"), "a/b"),
        ({Path("a"): 1, 2: None}, {"a": 1, "2": None}),
    ],
)
def test_numbers_of_more_than_63_bits_paths_and_keys_are_reported_as_texts(value, stored):
    """`value` is what a policy declares in its metadata, `stored` what a record then holds.

    Whole numbers between -2^63 and 2^63 stay numbers, which every reader of JSON takes; others,
    paths and keys of a mapping become texts.
    """
    assert as_json([value], "the metadata") == [stored]


@pytest.mark.parametrize(
    ("declared", "version"),
    [("v1", "v1"), (2, "2"), (0.5, "0.5"), (np.int64(3), "3"), (Path("a.pt"), "a.pt")],
)
def test_a_version_is_a_text_a_number_or_a_path(declared, version):
    """A policy declares its version in one of these ways; records hold it as a text."""
    assert read_version(SimpleNamespace(version=declared)) == version


@pytest.mark.parametrize(("frames", "count"), [("all", 10), (4, 3)])
def test_made_up_videos_have_the_pictures_that_a_policy_wants(frames, count):
    """The video has ten steps, of which a policy wants all pictures, or every fourth (0, 4 and 8).

    It wants the front camera only, so there are no pictures of the wrist.
    """
    needs = PolicyNeeds(cameras=("front",), demonstration_frames=frames)

    video = SyntheticEpisodes(needs).episode("Go.", 10).demonstration

    assert len(video["joint_positions"]) == 10
    assert len(video["front_rgb"]) == count
    assert "wrist_rgb" not in video


def test_made_up_videos_have_no_pictures_for_a_policy_that_wants_none():
    """The made-up video has 10 steps, and the policy declares `demonstration_frames="none"`."""
    needs = PolicyNeeds(cameras=("front",), demonstration_frames="none")

    video = SyntheticEpisodes(needs).episode("Go.", 10).demonstration

    assert "front_rgb" not in video


def test_made_up_observations_have_depth_matrices_and_a_history_that_ends_in_the_present():
    """A policy declares that it wants depth, the cameras' matrices, and every 4th step as a
    history.

    After a chunk of 16 steps it is shown, for each camera, depth in pictures of 256 x 256 and the
    usual 3 x 4 and 3 x 3 matrices. Its history has 16 / 4 = 4 moments, the last of which is now.
    """
    needs = PolicyNeeds(cameras=CAMERAS, observe_every=4, depth=True, calibration=True)
    studio = SyntheticEpisodes(needs)

    seen = studio.after(studio.episode("Go.", 0), 16)

    for camera in CAMERAS:
        assert seen[f"{camera}_depth"].shape == (256, 256, 1)
        assert seen[f"{camera}_extrinsic"].shape == (3, 4)
        assert seen[f"{camera}_intrinsic"].shape == (3, 3)
    assert len(seen["history"]) == 4
    for name, value in seen["history"][-1].items():
        assert np.array_equal(value, seen[name]), name
