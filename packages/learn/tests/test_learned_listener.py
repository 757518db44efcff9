"""The listener that learns: labels, what it reads and sees, its file, and its command."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from page_text import call
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

PAGE = Path(__file__).parents[3] / "docs" / "learned-policy.md"


@pytest.mark.parametrize("spec", ["learned:none", "trained:none?reader=none"])
def test_learned_policies_without_pytorch_fail_with_the_command_to_install_it(monkeypatch, spec):
    monkeypatch.setitem(sys.modules, "torch", None)

    with pytest.raises(MissingDependencyError, match="pip install torch"):
        make_policy(spec, 0)


def test_learning_without_pytorch_fails_with_the_command_to_install_it(monkeypatch, tmp_path):
    """None in the place of the module makes its import fail, as if it were not installed."""
    monkeypatch.setitem(sys.modules, "torch", None)

    done = CliRunner().invoke(app, ["learn", "listener", "--out", str(tmp_path / "new")])

    assert isinstance(done.exception, MissingDependencyError)
    assert "pip install torch" in str(done.exception)


@pytest.fixture(scope="module")
def views_of_video_unmask():
    """The first picture of an episode's video, which shows cubes, and one of their containers."""
    return views_at_start(get_episode("VideoUnmask", "train", 0))


@pytest.mark.sim
def test_training_labels_name_the_objects_that_are_visible(views_of_video_unmask):
    """Containers come down over the cubes."""
    first, later = views_of_video_unmask

    assert {"cube red", "cube green", "cube blue"} <= set(first.names)
    assert "container" not in first.names
    assert "container" in later.names
    assert not {"cube red", "cube green", "cube blue"} & set(later.names)


@pytest.mark.sim
def test_training_labels_have_the_places_of_objects_on_the_table(views_of_video_unmask):
    """In meters, within a centimeter."""
    scene = get_episode("VideoUnmask", "train", 0).scene
    places = np.array([item.position[:2] for item in scene.objects])

    for view in views_of_video_unmask:
        for name, place in zip(view.names, view.positions, strict=True):
            assert np.linalg.norm(places - place, axis=1).min() < 0.01, name


@pytest.mark.sim
def test_training_labels_have_the_places_of_objects_in_the_picture(views_of_video_unmask):
    """At its center a cube has its color."""
    first, _ = views_of_video_unmask

    assert first.picture.shape == (256, 256, 3)
    for name, (column, row) in zip(first.names, first.centers, strict=True):
        if name.startswith("cube"):
            red_green_blue = first.picture[round(float(row)), round(float(column))]
            assert ("red", "green", "blue")[int(red_green_blue.argmax())] in name


def test_a_hidden_cube_is_labeled_as_a_cube_of_its_color():
    hidden, *_ = get_episode("VideoUnmask", "train", 0).scene.of_kind("hidden_cube")
    assert class_of(hidden) == f"cube {hidden.color}"


@pytest.fixture(scope="module")
def torch():
    return pytest.importorskip("torch")


@pytest.mark.parametrize(
    ("answer", "parts"),
    [
        ('{"color": "red", "repeats": 2}', ["color=red", "repeats=2"]),
        ('{"colors": ["red", "blue"]}', ["colors.length=2", "colors.0=red", "colors.1=blue"]),
    ],
)
def test_an_answer_consists_of_a_part_for_each_value(answer, parts):
    """The listener learns parts of goals."""
    assert parts_of(answer) == parts


@pytest.mark.parametrize("task", ["BinFill", "VideoUnmask", "PickXtimes"])
def test_the_parts_of_an_answer_identify_its_goal(task):
    answers = goal_schema(task).goals

    assert len({tuple(parts_of(answer)) for answer in answers}) == len(answers)


def test_digits_are_read_as_words():
    """ "3rd" and "third", or "2" and "two", are the same words to a reader; 57 has no word."""
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
    """Three trainings are right in all of 50 episodes; the next episode may still be wrong."""
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
@pytest.mark.parametrize(
    ("ordinal", "visit"), [("second", 2), ("third", 3), ("fourth", 4), ("fifth", 5)]
)
def test_a_trained_listener_understands_stopcube_also_after_loading(
    trained_listener, ordinal, visit
):
    """It was trained on StopCube; the ordinal, such as *second*, names the visit to stop at."""
    from roboirg_learn.listener.learned_model import load_model

    model, path = trained_listener
    picture = views_at_start(get_episode("StopCube", "train", 0))[0].picture
    text = f"Stop the cube on the target during its {ordinal} visit by pressing the button."

    for listener in (model, load_model(path)):
        assert listener.understand("StopCube", text, [picture])["visit"] == visit


@pytest.mark.sim
def test_a_loaded_listener_knows_its_words_and_what_it_was_trained_on(trained_listener):
    """The fixture trained it on StopCube, in two settings, and saved it.

    After loading it has the same vocabulary, and refuses BinFill, on which it was not trained.
    """
    from roboirg_learn.listener.learned_model import load_model

    model, path = trained_listener
    picture = views_at_start(get_episode("BinFill", "train", 0))[0].picture

    loaded = load_model(path)

    assert loaded.vocabulary == model.vocabulary
    assert loaded.about["settings"] == ["explicit", "direct"]
    with pytest.raises(InvalidValueError, match="was not trained on BinFill, but on StopCube"):
        loaded.understand("BinFill", "Do it.", [picture])


def test_training_sentences_by_place_cover_several_goals_of_a_scene(torch):
    """A reader learns from one scene with three different goals, its own and two others of it.

    What *explicit* words mean does not depend on the scene, so there is one such sentence, for its
    own goal. *Spatial* words name places of the scene: a sentence for each of the three goals.
    """
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.listener.reader_training import instructions_of

    episode = get_episode("ButtonUnmask", "train", 3)
    plan = ReaderPlan(("ButtonUnmask",), ("explicit", "spatial"), goals=3)

    told = list(instructions_of([episode], plan))

    explicit_goal, own_goal, *others = [told_episode.goal for told_episode, _ in told]
    assert explicit_goal == own_goal == episode.goal
    assert len({own_goal, *others}) == 3
    assert set(others) <= set(get_task("ButtonUnmask").goals(episode.scene))
    assert len({text for _, text in told}) == 1 + 3


def test_training_on_a_task_that_no_sentence_speaks_of_is_refused(torch, monkeypatch):
    """The training sentences are replaced by a single one, which is of VideoUnmask."""
    from roboirg_learn.listener import reader_training
    from roboirg_learn.listener.reader_plan import ReaderPlan
    from roboirg_learn.listener.reader_training import check_reader

    only_sentence = (get_episode("VideoUnmask", "train", 3), "Lift it.")
    monkeypatch.setattr(reader_training, "spoken", lambda *_: [only_sentence])

    with pytest.raises(InvalidValueError, match=r"^There are no words of BinFill; name"):
        check_reader(ReaderPlan(("VideoUnmask", "BinFill"), ("direct",), goals=3))


@pytest.mark.sim
def test_a_trained_listener_plays_an_episode_with_the_oracle_s_hands(trained_listener):
    """The fixture trained a listener on explicit StopCube; the episode is one of its training.

    It understands the episode's own goal, and the oracle's hands act on it: actions have eight
    numbers, seven joint angles and the gripper. As these hands read the simulator, the policy is
    privileged.
    """
    import roboirg

    _, path = trained_listener
    policy = make_policy(f"learned:{path}", 0)
    env = roboirg.make("StopCube", setting="explicit", split="train", episode=1, cameras=("front",))
    observation, info = env.reset()

    policy.attach(env.unwrapped)
    policy.reset(observation["instruction"], info["demonstration"])

    goal = env.unwrapped.episode.goal
    assert policy.metadata["understood"] == dict(goal.as_mapping())
    assert policy.act(observation).shape[1] == 8
    assert read_policy(f"learned:{path}").is_privileged


@pytest.fixture
def encoder_of_the_documentation(monkeypatch):
    """Execute the Python example of the page, which registers the encoder "shades" for a while."""
    from roboirg_learn.listener import encoders

    monkeypatch.setitem(encoders.ENCODERS, "shades", None)  # so that it is taken away in the end
    (example,) = re.findall(r"```python\n(.*?class .*?)```", PAGE.read_text(), re.DOTALL)
    exec(example, {})  # noqa: S102 - the page's example


def scores_of(listener, picture):
    """Return the scores of all goals for "Stop it." and this picture."""
    seen = listener.see([picture])._replace(task="StopCube", text="Stop it.")
    return listener.reader([seen])[0]


@pytest.mark.sim
@pytest.mark.usefixtures("few_episodes", "encoder_of_the_documentation")
def test_a_listener_with_the_documentation_s_own_encoder_is_trained_saved_and_loaded(
    torch, tmp_path
):
    """The encoder "shades" reads the mean colors of fields of a picture, here of 4 x 4.

    The loaded listener has it, too: it gives a picture the same scores as before, and other ones to
    the picture at half its brightness.
    """
    from roboirg_learn.listener.learned_model import load_model, save_model
    from roboirg_learn.listener.listener_training import train_listener

    encoders = {"shades": {"size": 4}, "words": {}}
    plan = plan_of(reader_epochs=2, encoders=encoders)
    picture = views_at_start(get_episode("StopCube", "val", 0))[0].picture

    trained = train_listener(plan, tmp_path, "own", 0, lambda *_: None)
    save_model(trained, tmp_path / "own.safetensors")
    loaded = load_model(tmp_path / "own.safetensors")

    assert loaded.about["encoders"] == encoders
    assert torch.equal(scores_of(loaded, picture), scores_of(trained, picture))
    assert not torch.equal(scores_of(loaded, picture), scores_of(loaded, picture // 2))


@pytest.mark.parametrize(
    ("encoders", "words"),
    [
        ({"wrods": {}}, "encoder 'wrods'"),
        ({"words": {"size": 3}}, "Encoder 'words' with {'size': 3}"),
    ],
    ids=["misspelled", "without such an option"],
)
def test_a_wrong_encoder_is_refused_before_pictures_are_drawn(torch, tmp_path, encoders, words):
    """The plan of a training misspells the encoder "words", or gives it a size, which it has not.

    The command stops at once: it leaves no file.
    """
    plan = plan_file(tasks="StopCube", training={"encoders": encoders})

    done = CliRunner().invoke(
        app, ["learn", "listener", "--plan", plan, "--out", str(tmp_path / "own.safetensors")]
    )

    assert isinstance(done.exception, InvalidValueError)
    assert words in str(done.exception)
    assert not list(tmp_path.rglob("*.*"))


def scene_of(*views):
    """Return what is seen of a scene with containers and red cubes, each at a point (x, y)."""
    from roboirg_learn.listener.object_relations import SeenObjects, TablePlane, locate_and_rank

    classes = ("container", "cube red")
    seen = []
    for view in views:
        numbers = np.array([classes.index(name) for name, *_ in view], np.int64)
        places = np.array([place for _, *place in view], np.float32)
        seen.append(SeenObjects(numbers, places))
    return locate_and_rank(seen, TablePlane(np.eye(3), np.zeros((4, 2))), classes)


@pytest.mark.parametrize(
    ("hidden", "text", "objects"),
    [
        ("none", "Stop it.", 2),
        ("words", "", 2),
        ("pictures", "Stop it.", 0),
        ("video", "Stop it.", 0),
    ],
)
def test_variants_of_the_listener_get_no_words_no_pictures_or_no_video(
    torch, hidden, text, objects
):
    """A variant of the listener lacks an input, which shows what that is worth.

    Given are the sentence "Stop it." and two pictures, a cube and later a container: two objects.
    Without words the sentence is empty, without pictures nothing is seen. Nor is anything seen
    without the video of a scene that has one, which is known by its two pictures.
    """
    from roboirg_learn.listener.learned_model import hide_inputs
    from roboirg_learn.listener.vocabulary import ListenerInput

    seen = scene_of([("cube red", 0.0, 0.1)], [("container", 0.0, 0.1)])

    found = hide_inputs(ListenerInput("StopCube", "Stop it.", seen), hidden)

    assert found.text == text
    assert len(found.seen.classes) == objects


def test_a_listener_without_a_video_sees_a_scene_that_has_none(torch):
    """StopCube shows no video, so to hide the video hides nothing."""
    from roboirg_learn.listener.learned_model import hide_inputs
    from roboirg_learn.listener.vocabulary import ListenerInput

    given = ListenerInput("StopCube", "Stop it.", scene_of([("cube red", 0.0, 0.1)]))

    assert hide_inputs(given, "video") is given


@pytest.fixture
def short_study(few_episodes, tmp_path):
    """Run a short study of two seeds; returns its folder, and what runs it again."""
    short = {"scenes": 2, "detector_epochs": 1, "reader_epochs": 1, "seeds": 2}
    plan = plan_file(tasks="StopCube", training=short)

    def run():
        call("learn", "listener", "--study", "--plan", plan, "--out", tmp_path)

    run()
    return tmp_path, run


@pytest.mark.sim
def test_the_study_writes_every_listener_its_answers_and_tables(short_study):
    """The fixture trained two kinds of listener, *all* and *explicit*, with seeds 0 and 1 each.

    Each of the four has a file of its weights, and one of its answers, a line each: what it
    understood of StopCube, that is the visit at which to stop, and whether that is right. The page
    has three tables: for two pools of words, and for commands with a rival object.
    """
    folder, _ = short_study

    listeners = {"all-0", "all-1", "explicit-0", "explicit-1"}
    assert {path.stem for path in folder.glob("*.safetensors")} == listeners
    assert {path.stem for path in folder.glob("*-?.jsonl")} == listeners
    page = (folder / "study.md").read_text()
    assert page.count("## ") == 3
    assert "2 training seeds" in page
    for line in (folder / "all-1.jsonl").read_text().splitlines():
        answer = json.loads(line)
        goal = get_episode("StopCube", "test", answer["episode"]).goal
        assert answer["is_right"] == (answer["understood"]["visit"] == goal["visit"])


@pytest.mark.sim
def test_a_study_trains_again_only_the_listener_that_is_lost(short_study):
    """The fixture ran a study with four listeners, of which the file of one is deleted.

    Running it again writes only this file and that of its answers (by the times of change). The
    page of results is the same: a training can be repeated to the bit.
    """
    folder, run = short_study
    times = {path: path.stat().st_mtime_ns for path in folder.glob("*-?.*")}
    text = (folder / "study.md").read_text()
    lost = folder / "explicit-1.safetensors"
    lost.unlink()

    run()

    changed = {path for path, time in times.items() if path.stat().st_mtime_ns != time}
    assert changed == {lost, lost.with_suffix(".jsonl")}
    assert (folder / "study.md").read_text() == text
