"""What a checkpoint's folder says, before anything is loaded; LeRobot is not needed."""

import pytest
from checkpoint_folders import pictures, write_checkpoint

from roboirg.core.errors import InvalidValueError
from roboirg.policies import find_policy
from roboirg.policies.lerobot.checkpoint_facts import UNKNOWN, read_facts

SQUARE = [3, 96, 96]


def test_cameras_and_sizes_are_read_from_the_checkpoint_s_configuration(tmp_path):
    """The checkpoint's folder holds a configuration; it names cameras and a number of tokens.

    SQUARE is a picture of 96 x 96. Without a folder here, a checkpoint is taken to need both
    cameras.
    """
    one = write_checkpoint(tmp_path / "one", pictures(front=SQUARE), tokenizer_max_length=48)
    both = write_checkpoint(tmp_path / "both", pictures(wrist=[3, 256, 256], front=SQUARE))

    none = write_checkpoint(tmp_path / "none")

    assert read_facts(str(one)) == ({"front": 96}, 48)
    assert find_policy(f"lerobot://{one}").needs.cameras == ("front",)
    assert find_policy(f"lerobot://{both}").needs.cameras == ("front", "wrist")
    assert find_policy(f"lerobot://{none}").needs.cameras == ()
    assert find_policy("lerobot://somebody/elsewhere").needs.cameras == ("front", "wrist")


def test_a_checkpoint_that_needs_an_unknown_camera_is_refused_by_name(tmp_path):
    write_checkpoint(tmp_path / "laptop", pictures(laptop=SQUARE))
    said = "needs 'observation.images.laptop'; there are observation.state, obs"
    with pytest.raises(InvalidValueError, match=said):
        find_policy(f"lerobot://{tmp_path}/laptop")


@pytest.mark.parametrize(
    "content", ["{", "[]", "{}", "null", '{"type": 3, "input_features": null}']
)
def test_a_broken_configuration_file_counts_as_unknown(tmp_path, content):
    """LeRobot itself reports what is wrong when it loads the checkpoint."""
    folder = write_checkpoint(tmp_path / "act")
    (folder / "config.json").write_text(content)
    assert read_facts(str(folder)) == UNKNOWN


@pytest.mark.parametrize("shape", [None, [3], [3, "a", 9], "wide", [3, 0, 0], 7])
def test_a_picture_shape_that_makes_no_sense_counts_as_unknown(tmp_path, shape):
    folder = write_checkpoint(tmp_path / "act", pictures(front=shape))
    assert read_facts(str(folder)).sizes == {"front": None}
