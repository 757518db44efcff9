"""What a checkpoint's folder says, before anything is loaded; LeRobot is not needed."""

import pytest
from checkpoint_folders import FILES, pictures, write_checkpoint

from roboirg.core.errors import InvalidValueError
from roboirg.policies import find_policy
from roboirg.policies.lerobot_checkpoint import read_facts

SQUARE = [3, 96, 96]


def test_a_checkpoint_asks_for_its_own_cameras_and_sizes(tmp_path):
    one = write_checkpoint(tmp_path / "one", pictures(front=SQUARE), tokenizer_max_length=48)
    both = write_checkpoint(tmp_path / "both", pictures(wrist=[3, 256, 256], front=SQUARE))
    none = write_checkpoint(tmp_path / "none")
    assert read_facts(str(one)) == ({"front": 96}, 48)
    assert find_policy(f"lerobot://{one}").needs.cameras == ("front",)
    assert find_policy(f"lerobot://{both}").needs.cameras == ("front", "wrist")
    assert find_policy(f"lerobot://{none}").needs.cameras == ()
    assert find_policy("lerobot://somebody/elsewhere").needs.cameras == ("front", "wrist")


def test_folders_that_are_no_checkpoints_are_one_sentence_each(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_checkpoint(tmp_path / "outputs/act/checkpoints/last/pretrained_model")
    laptop = pictures(laptop=SQUARE)
    write_checkpoint(tmp_path / "laptop", laptop)
    write_checkpoint(tmp_path / "foreign")
    (tmp_path / "foreign/config.json").write_text('{"model_type": "bert"}')
    last = "checkpoints/last/pretrained_model"
    for place, said in {
        "outputs/actt": "There is no folder 'outputs/actt'",
        "nothing": "There is no folder 'nothing'",
        "./some/where/else": "There is no folder './some/where/else'",
        "/none/of/it": "There is no folder '/none/of/it'",
        "outputs/act": f"has no config.json; a checkpoint of .* into {last}",
        f"outputs/act/{last}/config.json": "There is no folder",
        "laptop": "needs 'observation.images.laptop'; there are observation.state, obs",
        "foreign": "does not describe a LeRobot policy",
    }.items():
        with pytest.raises(InvalidValueError, match=f"^.*{said}.*$"):
            find_policy(f"lerobot://{place}")


@pytest.mark.parametrize("name", FILES)
def test_each_file_of_a_checkpoint_is_missed(tmp_path, name):
    folder = write_checkpoint(tmp_path / "act")
    (folder / name).unlink()
    with pytest.raises(InvalidValueError, match=f"has no {name}"):
        read_facts(str(folder))


@pytest.mark.parametrize("content", ["{", "[]", "{}", "null", '{"type": 3, "input_features": {}}'])
def test_a_damaged_configuration_is_named(tmp_path, content):
    folder = write_checkpoint(tmp_path / "act")
    (folder / "config.json").write_text(content)
    with pytest.raises(InvalidValueError, match=r"config\.json' does not describe"):
        read_facts(str(folder))


@pytest.mark.parametrize("shape", [None, [3], [3, "a", 9], "wide", [3, 0, 0], 7])
def test_sizes_that_make_no_sense_are_unknown(tmp_path, shape):
    folder = write_checkpoint(tmp_path / "act", pictures(front=shape))
    assert read_facts(str(folder)).sizes == {"front": None}
