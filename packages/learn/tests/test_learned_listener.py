"""The listener that learns: labels, what it reads and sees, its file, and its command."""

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.extension import episodes
from roboirg.extension.sight import class_of
from roboirg.main import app
from roboirg.policies.by_name.finding import make_policy, read_policy
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.labeled_views import views_at_start
from roboirg_learn.listener import listener_study, study_report
from roboirg_learn.listener.listener_study import VARIANTS
from roboirg_learn.listener.study_report import trained_rate
from roboirg_learn.listener.vocabulary import parts_of, split_words

PAGE = Path(__file__).parents[3] / "docs" / "learned-listener.md"


def test_learned_policies_without_pytorch_fail_with_the_command_to_install_it(
    monkeypatch, tmp_path
):
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    for spec in ("learned:none", "trained:none?reader=none"):
        with pytest.raises(MissingDependencyError, match="pip install torch"):
            make_policy(spec, 0)

    done = CliRunner().invoke(
        app, ["learn", "listener", "--out", str(tmp_path / "new.safetensors")]
    )
    with pytest.raises(MissingDependencyError, match="pip install torch"):
        raise done.exception


@pytest.mark.sim
def test_training_labels_name_the_visible_objects_with_their_places():
    """First only cubes are visible, later only the containers over them."""
    episode = get_episode("VideoUnmask", "train", 0)
    places = [item.position[:2] for item in episode.scene.objects]
    cubes = {"cube red", "cube green", "cube blue"}

    first, later = views_at_start(episode)

    assert cubes <= set(first.names)
    assert "container" not in first.names  # they appear over the cubes
    assert not cubes & set(later.names)
    assert later.names.count("container") == len(episode.scene.of_kind("container"))
    for view in (first, later):
        assert (view.picture.shape, len(view.centers)) == ((256, 256, 3), len(view.names))
        for name, place in zip(view.names, view.positions, strict=True):
            assert min(np.linalg.norm(place - other) for other in places) < 0.01, name
    for name, (column, row) in zip(first.names, first.centers, strict=True):
        if name in cubes:
            pixel = first.picture[round(float(row)), round(float(column))].astype(int)
            assert ("red", "green", "blue")[int(pixel.argmax())] in name


def test_a_hidden_cube_is_labeled_as_a_cube_of_its_color():
    hidden, *_ = get_episode("VideoUnmask", "train", 0).scene.of_kind("hidden_cube")
    assert class_of(hidden) == f"cube {hidden.color}"


@pytest.fixture(scope="module")
def torch():
    return pytest.importorskip("torch")


def test_the_parts_of_an_answer_identify_its_goal():
    """The listener learns parts of goals, such as "color=red"."""
    assert parts_of('{"color": "red", "repeats": 2}') == ["color=red", "repeats=2"]
    assert parts_of('{"colors": ["red", "blue"]}') == [
        "colors.length=2",
        "colors.0=red",
        "colors.1=blue",
    ]
    for task in ("BinFill", "VideoUnmask", "PickXtimes"):
        goals = goal_schema(task).goals
        assert len({tuple(parts_of(answer)) for answer in goals}) == len(goals)


def test_digits_are_read_as_words():
    said = "Pick up the 3rd cube 2 times, then 57."
    assert split_words(said) == split_words("pick up the third cube two times, then 57.")
    assert "57" in split_words(said)


def test_three_trainings_that_agree_have_the_interval_of_a_single_one():
    """A row is a training, a column an episode: 40 of 50 are right."""
    single = np.array([[1.0] * 40 + [0.0] * 10])

    alike = trained_rate([np.tile(single, (3, 1))])

    assert alike.rate == pytest.approx(0.8)
    assert alike.interval == pytest.approx(trained_rate([single]).interval)


def test_the_interval_of_trainings_that_differ_contains_each_of_their_rates():
    """Three trainings are right in 40, 40 and 20 of 50 episodes."""
    trainings = np.array([[1.0] * 40 + [0.0] * 10] * 2 + [[1.0] * 20 + [0.0] * 30])

    found = trained_rate([trainings])

    low, high = found.interval
    assert low < 0.4
    assert high > 0.8


def test_a_rate_of_one_has_an_interval_below_it():
    certain = trained_rate([np.ones((3, 50))])
    assert certain.rate == 1.0
    assert 0.9 < certain.interval[0] < certain.interval[1] == 1.0


def test_the_interval_of_a_share_of_one_percent_reaches_above_one_of_five():
    """One right answer of 100 scenes; Student's alone would end at 3 %."""
    verdicts = np.zeros((1, 100))
    verdicts[0, 0] = 1
    low, high = trained_rate([verdicts]).interval
    assert 0 < low < 0.01
    assert 0.05 < high < 0.06


def scene_of(*views):
    """What is seen of a scene with containers and red cubes."""
    from roboirg_learn.listener.object_relations import SeenObjects, TablePlane, locate_and_rank

    classes = ("container", "cube red")
    seen = []
    for view in views:
        numbers = np.array([classes.index(name) for name, *_ in view], np.int64)
        places = np.array([place for _, *place in view], np.float32)
        seen.append(SeenObjects(numbers, places))
    return locate_and_rank(seen, TablePlane(np.eye(3), np.zeros((4, 2))), classes)


def plan_of(detector_epochs=1, **changes):
    from roboirg_learn.listener.listener_training import TrainingPlan
    from roboirg_learn.listener.reader_plan import ReaderPlan

    reader = ReaderPlan(("StopCube",), ("explicit", "direct"), scenes=3, reader_epochs=24)
    return TrainingPlan(reader._replace(**changes), detector_epochs)


def test_a_training_plan_records_the_version_of_its_words(torch):
    _, words = plan_of().about["language_version"].split()
    assert words.startswith("StopCube/train@")


@pytest.fixture
def few_episodes(torch, monkeypatch):
    """Few episodes of each split, and two listeners in a study."""
    from roboirg_learn.listener import listener_training

    monkeypatch.setattr(episodes, "SIZES", {"train": 4, "test": 3})
    monkeypatch.setattr(listener_training, "VALIDATED", 1)
    for module in (listener_study, study_report):
        monkeypatch.setattr(module, "VARIANTS", VARIANTS[:2])


@pytest.fixture(scope="module")
def trained_listener(torch, tmp_path_factory):
    """Explicit and direct StopCube: the words are enough."""
    from roboirg_learn.listener.learned_model import save_model
    from roboirg_learn.listener.listener_training import train_listener

    torch.set_num_threads(1)
    folder = tmp_path_factory.mktemp("learned")
    model = train_listener(plan_of(), folder, "listener", 0, lambda *_: None)
    path = folder / "listener.safetensors"
    save_model(model, path)
    return model, path


@pytest.mark.sim
def test_a_trained_listener_understands_stopcube_and_is_equal_after_loading(trained_listener):
    from roboirg_learn.listener.learned_model import load_model

    model, path = trained_listener
    again = load_model(path)
    assert again.vocabulary == model.vocabulary
    assert again.about["settings"] == ["explicit", "direct"]
    picture = views_at_start(get_episode("StopCube", "train", 0))[0].picture
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


def test_training_sentences_by_place_cover_several_goals_of_a_scene(torch):
    """With three goals a scene: one explicit sentence, and three that name places."""
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.listener.reader_training import instructions_of

    episode = get_episode("ButtonUnmask", "train", 3)
    plan = ReaderPlan((episode.task,), ("explicit", "spatial"), goals=3)
    told = list(instructions_of([episode], plan))
    explicit, *others = [episode.goal for episode, _ in told]
    assert explicit == episode.goal
    by_place = others
    assert by_place[0] == episode.goal
    assert len(set(by_place)) == 3
    assert set(by_place) <= set(get_task(episode.task).goals(episode.scene))
    assert len({text for _, text in told}) == 4


def test_training_on_a_task_that_no_sentence_speaks_of_is_refused(torch, monkeypatch):
    from roboirg_learn.listener import reader_training
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.listener.reader_training import check_reader

    episode = get_episode("VideoUnmask", "train", 3)
    plan = ReaderPlan(("VideoUnmask",), ("direct",), goals=3)
    check_reader(plan)
    monkeypatch.setattr(reader_training, "spoken", lambda *_: [(episode, "Lift it.")])
    with pytest.raises(InvalidValueError, match=r"^There are no words of BinFill; name"):
        check_reader(plan._replace(tasks=("VideoUnmask", "BinFill")))


@pytest.mark.sim
def test_a_trained_listener_plays_an_episode_with_the_oracle_s_hands(trained_listener):
    import roboirg

    _, path = trained_listener
    spec = f"learned:{path}"
    assert read_policy(spec).is_privileged
    policy = make_policy(spec, 0)
    told = {"setting": "explicit", "split": "train", "episode": 1}
    env = roboirg.make("StopCube", **told, cameras=("front",))
    observation, info = env.reset()
    policy.attach(env.unwrapped)
    policy.reset(observation["instruction"], info["demonstration"])
    goal = env.unwrapped.episode.goal
    assert policy.metadata["understood"] == dict(goal.as_mapping())
    assert policy.act(observation).shape[1] == 8


@pytest.mark.sim
def test_the_documentation_s_own_encoder_is_trained_saved_and_loaded(
    few_episodes, torch, tmp_path, monkeypatch
):
    from roboirg_learn.listener import encoders
    from roboirg_learn.listener.learned_model import load_model, save_model
    from roboirg_learn.listener.listener_training import train_listener

    monkeypatch.setitem(encoders.ENCODERS, "shades", None)  # which takes it away in the end
    (block,) = re.findall(r"```python\n(.*?class .*?)```", PAGE.read_text(), re.DOTALL)
    exec(block, {})  # noqa: S102 - the page's example
    plan = plan_of(reader_epochs=2, encoders={"shades": {"size": 4}, "words": {}})
    model = train_listener(plan, tmp_path, "own", 0, lambda *_: None)
    save_model(model, tmp_path / "own.safetensors")
    again = load_model(tmp_path / "own.safetensors")
    assert again.about["encoders"] == {"shades": {"size": 4}, "words": {}}
    picture = views_at_start(get_episode("StopCube", "val", 0))[0].picture
    with torch.no_grad():
        mine, theirs, dark = (
            reader.reader([reader.see([seen])._replace(task="StopCube", text="Stop it.")])[0]
            for reader, seen in ((model, picture), (again, picture), (again, picture // 2))
        )
    assert torch.equal(mine, theirs)
    assert not torch.equal(mine, dark)


def test_a_wrong_encoder_is_refused_before_pictures_are_drawn(torch, tmp_path):
    for encoders, words in (
        ({"wrods": {}}, "encoder 'wrods'"),
        ({"words": {"size": 3}}, "Encoder 'words' with {'size': 3}"),
    ):
        plan = plan_file(tasks="StopCube", training={"encoders": encoders})
        call = ["learn", "listener", "--plan", plan, "--out", str(tmp_path / "own.safetensors")]
        with pytest.raises(InvalidValueError, match=words):
            raise CliRunner().invoke(app, call).exception
    assert not list(tmp_path.rglob("*.*"))


def test_variants_of_the_listener_get_no_words_no_pictures_or_no_video(torch):
    """A variant shows what an input is worth; `hide_inputs` takes it away."""
    from roboirg_learn.listener.learned_model import hide_inputs
    from roboirg_learn.listener.vocabulary import ListenerInput

    seen = scene_of([("cube red", 0.0, 0.1)], [("container", 0.0, 0.1)])
    given = ListenerInput("StopCube", "Stop it.", seen)
    assert hide_inputs(given, "none") is given
    assert hide_inputs(given, "words").text == ""
    assert len(hide_inputs(given, "pictures").seen.classes) == 0
    assert len(hide_inputs(given, "video").seen.classes) == 0
    without_video = given._replace(seen=scene_of([("cube red", 0.0, 0.1)]))
    assert hide_inputs(without_video, "video") is without_video


@pytest.fixture
def short_study(few_episodes, tmp_path):
    """Run a short study of two seeds; returns its folder, and what runs it again."""
    short = {"scenes": 2, "detector_epochs": 1, "reader_epochs": 1, "seeds": 2}
    plan = plan_file(tasks="StopCube", training=short)

    def run():
        words = ["learn", "listener", "--study", "--plan", plan, "--out", str(tmp_path)]
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, done.output

    run()
    return tmp_path, run


@pytest.mark.sim
def test_the_study_writes_every_listener_its_answers_and_tables(short_study):
    folder, _ = short_study

    expected = set()
    for variant, seed in itertools.product(VARIANTS[:2], (0, 1)):
        name = f"{variant.name}-{seed}"
        expected |= {f"{name}.safetensors", f"{name}.jsonl"}
    assert {path.name for path in folder.glob("*-?.*")} == expected
    text = (folder / "study.md").read_text()
    assert text.count("## ") == 3
    assert "2 training seeds" in text
    for line in (folder / "all-1.jsonl").read_text().splitlines():
        answer = json.loads(line)
        goal = get_episode("StopCube", "test", answer["episode"]).goal
        assert answer["is_right"] == (answer["understood"]["visit"] == goal["visit"])


@pytest.mark.sim
def test_a_study_trains_again_only_the_listener_that_is_lost(short_study):
    folder, run = short_study
    times = {path: path.stat().st_mtime_ns for path in folder.glob("*-?.*")}
    text = (folder / "study.md").read_text()
    lost = folder / "explicit-1.safetensors"
    lost.unlink()

    run()

    changed = {path for path, time in times.items() if path.stat().st_mtime_ns != time}
    assert changed == {lost, lost.with_suffix(".jsonl")}
    assert (folder / "study.md").read_text() == text
