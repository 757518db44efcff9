"""The listener that learns: labels, what it reads and sees, its file, and its command."""

import numpy as np
import pytest
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg.apps.learning.labeled_views import LATER_STEP, class_of, look
from roboirg.apps.learning.listener.listener_study import VARIANTS
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.main import app
from roboirg.policies.by_name.loading import is_privileged, make_policy
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode


def test_without_pytorch_one_sentence_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(MissingDependencyError, match=r"\[learn\]"):
        make_policy(f"learned:{tmp_path / 'none.pt'}", 0)
    done = CliRunner().invoke(app, ["learn", "listener", "--out", str(tmp_path / "new.pt")])
    with pytest.raises(MissingDependencyError, match=r"\[learn\]"):
        raise done.exception


@pytest.mark.parametrize(
    ("spec", "words"), [("learned:", "names no file"), ("learned:a.pt?speed=2", "no option of")]
)
def test_wrong_names_are_one_sentence(spec, words):
    with pytest.raises(InvalidValueError, match=words):
        make_policy(spec, 0)


@pytest.mark.sim
def test_labels_are_what_is_visible_and_where():
    episode = get_episode("VideoUnmask", "train", 0)
    first, later = look(episode)
    cubes = {"cube red", "cube green", "cube blue"}
    assert cubes <= set(first.names)
    assert "container" not in first.names  # they appear over the cubes
    assert not cubes & set(later.names)
    assert later.names.count("container") == len(episode.scene.of_kind("container"))
    for view in (first, later):
        assert view.picture.shape == (256, 256, 3)
        assert view.centers.shape == (len(view.names), 2)
    for view in (first, later):
        there = {item.name: item.position[:2] for item in episode.scene.objects}
        for name, place in zip(view.names, view.positions, strict=True):
            assert min(np.linalg.norm(place - one) for one in there.values()) < 0.01, name
    for name, (column, row) in zip(first.names, first.centers, strict=True):
        if name in cubes:
            pixel = first.picture[round(float(row)), round(float(column))].astype(int)
            assert ("red", "green", "blue")[int(pixel.argmax())] in name
    (only,) = look(get_episode("StopCube", "train", 0))
    assert "target" in only.names
    hidden = episode.scene.of_kind("hidden_cube")[0]
    assert class_of(hidden) == f"cube {hidden.color}"


@pytest.fixture(scope="module")
def torch():
    return pytest.importorskip("torch")


def test_answers_fall_apart_into_parts_that_tell_them_apart(torch):
    from roboirg.apps.learning.listener.listener_net import parts_of

    assert parts_of('{"color": "red", "repeats": 2}') == ["color=red", "repeats=2"]
    assert parts_of('{"colors": ["red", "blue"]}') == [
        "colors.length=2",
        "colors.0=red",
        "colors.1=blue",
    ]
    for task in ("BinFill", "VideoUnmask", "PickXtimes"):
        goals = goal_schema(task).goals
        assert len({tuple(parts_of(answer)) for answer in goals}) == len(goals)


def test_of_a_video_the_first_frame_and_a_later_one_are_seen():
    pytest.importorskip("torch")
    from roboirg.apps.learning.listener.learned_model import pictures_to_see

    frames = [np.full((2, 2, 3), number, np.uint8) for number in range(9)]
    now = np.full((2, 2, 3), 99, np.uint8)
    assert [one.max() for one in pictures_to_see(now, [], 8)] == [99]
    assert [one.max() for one in pictures_to_see(now, frames, 8)] == [0, LATER_STEP // 8]
    assert [one.max() for one in pictures_to_see(now, frames[:2], 8)] == [0, 1]


def scene_of(*views):
    """What is seen of a scene with containers and red cubes."""
    from roboirg.apps.learning.listener.object_relations import SeenObjects, TablePlane, relate

    classes = ("container", "cube red")
    seen = [
        SeenObjects(
            np.array([classes.index(one[0]) for one in view], np.int64),
            np.array([one[1:] for one in view], np.float32),
        )
        for view in views
    ]
    return relate(seen, TablePlane(np.eye(3), np.zeros((4, 2))), classes)


def plan_of(**changes):
    from roboirg.apps.learning.listener.listener_training import TrainingPlan

    few = TrainingPlan(("StopCube",), ("explicit", "direct"), detector_epochs=1, reader_epochs=8)
    return few._replace(**changes)


@pytest.fixture(scope="module")
def trained(torch, tmp_path_factory):
    """Explicit and direct StopCube: the words are enough."""
    from roboirg.apps.learning.listener.learned_model import save_model
    from roboirg.apps.learning.listener.listener_training import train_listener

    torch.set_num_threads(1)
    model = train_listener(plan_of(), 0, lambda *_: None)
    path = tmp_path_factory.mktemp("learned") / "listener.pt"
    save_model(model, path)
    return model, path


@pytest.mark.sim
def test_it_learns_and_its_file_is_the_same_listener(trained):
    from roboirg.apps.learning.listener.learned_model import load_model

    model, path = trained
    again = load_model(path)
    assert again.vocabulary == model.vocabulary
    assert again.about["settings"] == ["explicit", "direct"]
    picture = look(get_episode("StopCube", "train", 0))[0].picture
    texts = {
        visit: f"Stop the cube on the target during its {word} visit by pressing the button."
        for visit, word in ((2, "second"), (3, "third"), (4, "fourth"), (5, "fifth"))
    }
    understood = {
        visit: again.understand("StopCube", text, [picture])["visit"]
        for visit, text in texts.items()
    }
    assert understood == {visit: visit for visit in texts}
    assert all(
        model.understand("StopCube", text, [picture])["visit"] == understood[visit]
        for visit, text in texts.items()
    )
    with pytest.raises(InvalidValueError, match="was not trained on BinFill, but on StopCube"):
        again.understand("BinFill", "Do it.", [picture])


def test_by_place_other_goals_of_a_scene_are_told_too(torch):
    from roboirg.apps.learning.listener.reader_training import said

    episode = get_episode("ButtonUnmask", "train", 3)
    told = list(said([episode], ("explicit", "spatial"), "train", 3, 0))
    by_place = [one.goal for one, words in told if words.setting == "spatial"]
    assert [one.goal for one, words in told if words.setting == "explicit"] == [episode.goal]
    assert by_place[0] == episode.goal
    assert len(set(by_place)) == 3
    assert set(by_place) <= set(get_task(episode.task).goals(episode.scene))
    assert len({words.text for _, words in told}) == 4


@pytest.mark.sim
def test_it_plays_with_the_hands_of_the_oracle(trained):
    import roboirg

    _, path = trained
    spec = f"learned:{path}"
    assert is_privileged(spec)
    policy = make_policy(spec, 0)
    env = roboirg.make("StopCube", setting="explicit", split="train", episode=1, cameras=("front",))
    observation, info = env.reset()
    policy.attach(env.unwrapped)
    policy.reset(observation["instruction"], info["demonstration"])
    goal = env.unwrapped.episode.goal
    assert policy.metadata["understood"] == dict(goal.as_mapping())
    assert policy.act(observation).shape[1] == 8


@pytest.mark.sim
def test_the_same_plan_gives_the_same_listener(trained, torch):
    from roboirg.apps.learning.listener.listener_training import train_listener

    plan = plan_of(reader_epochs=1)
    one, other = (train_listener(plan, 0, lambda *_: None) for _ in range(2))
    mine, theirs = one.reader.state_dict(), other.reader.state_dict()
    assert all(torch.equal(mine[name], theirs[name]) for name in mine)


@pytest.mark.parametrize("content", [b"", b"not a checkpoint", None])
def test_files_that_are_no_listener_are_one_sentence(torch, tmp_path, content):
    path = tmp_path / "listener.pt"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InvalidValueError, match=r"no trained listener|cannot be read"):
        make_policy(f"learned:{path}", 0)


def test_what_a_variant_does_not_get_changes_nothing(torch):
    from roboirg.apps.learning.listener.learned_model import hide
    from roboirg.apps.learning.listener.listener_net import ListenerInput

    seen = scene_of([("cube red", 0.0, 0.1)], [("container", 0.0, 0.1)])
    given = ListenerInput("StopCube", "Stop it.", seen)
    assert hide(given, "none") is given
    assert hide(given, "words").text == ""
    assert len(hide(given, "pictures").seen.kinds) == 0
    assert len(hide(given, "video").seen.kinds) == 0
    without_video = given._replace(seen=scene_of([("cube red", 0.0, 0.1)]))
    assert hide(without_video, "video") is without_video


@pytest.mark.sim
def test_the_study_writes_every_listener_a_table_and_a_figure(torch, tmp_path):
    short = {"scenes": 0, "detector_epochs": 1, "reader_epochs": 2}
    plan = plan_file(tasks="StopCube", training=short)
    words = ["learn", "listener", "--study", "--plan", plan, "--out", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    names = {one.name for one in tmp_path.glob("*.pt")}
    assert names == {f"{variant.name}.pt" for variant in VARIANTS}
    text = (tmp_path / "study.md").read_text()
    assert text.count("## ") == 3
    assert (tmp_path / "study.png").stat().st_size > 5000
