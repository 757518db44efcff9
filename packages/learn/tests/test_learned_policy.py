"""The policy that learns to act: what it is recorded from, its file, its command, and its play."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg.core.errors import InvalidValueError
from roboirg.envs.factory import make
from roboirg.extension.sight import ExpertRecording, record_expert
from roboirg.language.settings import plain_settings
from roboirg.main import app
from roboirg.policies import play
from roboirg.policies.builtin.waypoint_expert import WaypointExpert
from roboirg.policies.by_name.finding import make_policy, read_policy
from roboirg.records.store import read_records
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import locked
from roboirg_learn.commands import print_policy
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.policy.moves import NO_LABEL, common_moves, decisions_of
from roboirg_learn.policy.policy_files import PolicyFiles
from roboirg_learn.policy.policy_plan import BodyPlan, Recorded
from roboirg_learn.policy.recording_files import load_recording, save_recording
from roboirg_learn.policy.sight import encode_yaws, object_classes_of
from roboirg_learn.policy.timing import DUE_TIME, passes_so_far, steps_to_act, timed_move

RESULTS = Path(__file__).parents[3] / "results"
SHIPPED = PolicyFiles(
    RESULTS / "recurrent.body.safetensors", RESULTS / "recurrent.reader.safetensors"
)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("learned:", "names no file"),
        ("learned:a?speed=2", "no option of"),
        ("learned:none", "No such file"),
        ("trained:", "names no file"),
        ("trained:a?reader=b&speed=2", "no option of"),
        ("trained:none?reader=b", "'none' is no trained body .No such file"),
        ("trained:a", r"no reader of words; name one with \?reader=FILE. Train .* --body a --out"),
    ],
)
def test_a_wrong_name_of_a_learned_policy_is_refused_with_the_reason(spec, words):
    pytest.importorskip("torch")
    with pytest.raises(InvalidValueError, match=words):
        make_policy(spec, 0)


@pytest.mark.sim
def test_the_waypoint_expert_solves_an_episode():
    env = make(get_episode("PickXtimes", "train", 0), actions="waypoint", cameras=())
    assert play(env, WaypointExpert())["status"] == "success"


@pytest.fixture(scope="module")
def recorded():
    return record_expert(get_episode("ButtonUnmask", "random", 0))


@pytest.mark.sim
def test_recorded_labels_are_the_expert_s_though_its_motion_was_disturbed(recorded):
    """Recordings disturb the arm so that a policy learns to recover; labels must ignore that."""
    assert recorded.status == "success"

    episode = get_episode("ButtonUnmask", "random", 0)
    for decision in decisions_of(recorded):
        if decision.move.at_object:
            at = recorded.things[decision.look, decision.object_number, :2]
            action = recorded.actions[recorded.looks.tolist().index(decision.look)]
            assert np.linalg.norm(action[:2] - at) < 0.02
    grasped = [
        decision.object_number
        for decision in decisions_of(recorded)
        if decision.move.turn == "align"
    ]
    goal = episode.goal.texts("colors")
    inside = {item.inside for item in episode.scene.objects if item.color in goal}

    assert {recorded.names[thing] for thing in grasped} == inside

    plain = record_expert(episode, disturbed=False)
    assert not np.array_equal(plain.tool[: len(recorded.tool)], recorded.tool[: len(plain.tool)])


def recording_with_actions(actions, looks):
    """Return a recording of these waypoints at one thing, at looks in which nothing moves."""
    length = max(looks) + 1
    times = np.arange(length)
    return ExpertRecording(
        key="made/up/0",
        names=("cube",),
        classes=("cube",),
        things=np.zeros((length, 1, 4), np.float32),
        visible=np.ones((length, 1), bool),
        tool=np.zeros((length, 7), np.float32),
        is_video=np.zeros(length, bool),
        steps=times,
        done=np.zeros_like(times),
        looks=np.array(looks),
        actions=np.array(actions, np.float32),
        anchors=np.zeros(len(actions), int),
        turns=("align",) * len(actions),
        pictures={},
        status="success",
    )


def test_a_repeated_waypoint_is_labeled_with_the_gripper_command_that_follows():
    """Actions are x, y, z, roll, pitch, yaw and gripper; -1 closes it."""
    down = [0, 0, 0.02, 0, 0, 0, 0]
    close = [0, 0, 0.02, 0, 0, 0, -1]
    above = [0, 0, 0.15, 0, 0, 0, 0]

    found = decisions_of(recording_with_actions([above, down, down, close, above], [0, 1, 2, 3, 4]))

    assert [decision.look for decision in found] == [0, 1, 2, 4]
    assert [decision.move.gripper for decision in found] == [0, -1, -1, 0]


def test_passes_of_a_moving_cube_over_its_target_are_counted_at_each_look():
    """It moves along x, back and forth, with the target at 0."""
    recorded = recording_with_actions([np.zeros(7)], [4])
    assert (passes_so_far(recorded) == NO_LABEL).all()
    things = np.zeros((5, 2, 4))
    things[:, 0, 0] = [-3, -1, 2, 1, -1]
    moving = recorded._replace(classes=("shuttle", "target"), things=things)

    assert passes_so_far(moving).tolist() == [0, 0, 1, 1, 2]


def test_the_time_of_a_wait_is_counted_down_to_the_next_move():
    """The expert goes above the button, closes the hand, waits twice, presses, and stays."""
    above, close, down = np.eye(7)[[2, 6, 1]]
    actions = [above, close, close, close, down, close, close]
    recorded = recording_with_actions(actions, [0, 1, 2, 4, 5, 7, 8])

    # Close after down is the gripper's value of that move; the last wait never ends.
    assert steps_to_act(recorded).tolist() == [-1, -1, 3, 2, 1, 0, -1, -1, -1]


@given(st.floats(0.0, 5.0), st.booleans(), st.permutations([0.1, 0.2, 0.3]))
def test_a_waiting_policy_moves_when_less_than_a_wait_is_left(time, was_waiting, scores):
    """Whatever it would do otherwise; only the last move is a wait."""
    chosen = timed_move(
        np.array(scores), np.array([False, False, True]), time, was_waiting=was_waiting
    )

    is_about_to_wait = was_waiting or max(scores) == scores[2]
    is_wait = is_about_to_wait and time >= DUE_TIME
    best_move = int(scores[1] > scores[0])
    assert chosen == (2 if is_wait else best_move)


@pytest.mark.sim
def test_a_training_that_was_interrupted_ends_with_the_same_weights(recorded, tmp_path):
    """Of four passes the command is interrupted after the second."""
    torch = pytest.importorskip("torch")
    train = trainer(recorded, tmp_path)
    passes = []

    def stop(work, done, total, note):
        if done == 2:
            raise KeyboardInterrupt

    whole = train("whole", lambda *_: None)
    with pytest.raises(KeyboardInterrupt):
        train("parts", stop)
    parts = train("parts", lambda work, done, total, note: passes.append(done))

    assert passes == [3, 4]
    for name, value in whole.state_dict().items():
        assert torch.equal(value, parts.state_dict()[name]), name
    curve = json.loads((tmp_path / "parts" / "body-recurrent-0.json").read_text())
    assert [line["epoch"] for line in curve] == [1, 2, 3, 4]


def trainer(recorded, out):
    """Return what trains a body in four passes, in a folder of a given name."""
    from roboirg_learn.listener.vocabulary import parts_of_tasks
    from roboirg_learn.policy.body_training import BodyExample, BodyLayout, train_body
    from roboirg_learn.policy.trained_body import GoalLayout

    plan = BodyPlan(("ButtonUnmask",), body_epochs=4)
    episode = get_episode("ButtonUnmask", "random", 0)
    decisions = decisions_of(recorded)
    goals = GoalLayout(plan.tasks, parts_of_tasks(plan.tasks))
    layout = BodyLayout(object_classes_of([recorded]), goals, common_moves([decisions]))

    def train(name, progress):
        folder_of_policy = out / name
        folder_of_policy.mkdir(exist_ok=True)
        examples = [BodyExample(Recorded(episode, recorded), decisions)] * 3
        return train_body(plan, examples, layout, folder_of_policy, progress)

    return train


@pytest.mark.parametrize("seed", range(4))
def test_moved_and_mirrored_pictures_keep_their_labels(seed):
    """The one white pixel of the picture is the labeled object."""
    pytest.importorskip("torch")
    from roboirg_learn.policy.object_detector import LabeledPicture, augmented

    picture = np.zeros((256, 256, 3), np.uint8)
    picture[100, 50] = 255
    yaw_codes = encode_yaws(np.array([0.2]))
    view = LabeledPicture(picture, np.array([0]), np.array([[50.5, 100.5]]), yaw_codes)
    found = augmented(view, np.random.default_rng(seed))
    ((row, column),) = np.argwhere(found.picture[..., 0] == 255)
    assert found.points.tolist() == [[column + 0.5, row + 0.5]]
    is_mirrored = column > 128
    assert np.allclose(found.yaw_codes, encode_yaws(np.array([-0.2 if is_mirrored else 0.2])))


@pytest.mark.sim
def test_a_recording_notes_which_objects_are_visible_and_how_many_stages_are_done(recorded):
    """The containers cover the cubes by step 40."""
    stages = len(get_episode("ButtonUnmask", "random", 0).stages)
    assert recorded.done[0] == 0
    assert (np.diff(recorded.done) >= 0).all()
    assert stages - 1 <= recorded.done[-1] <= stages

    classes = np.array(recorded.classes)
    cubes = np.char.startswith(classes, "cube")
    assert recorded.visible[0, cubes].all()
    assert not recorded.visible[0, classes == "container"].any()

    covered = int(np.flatnonzero(recorded.steps >= 40)[0])
    assert not recorded.visible[covered, cubes].any()
    assert recorded.visible[covered, classes == "container"].all()


@pytest.mark.sim
def test_a_recording_is_read_as_it_was_written(recorded, tmp_path):
    path = tmp_path / "one.npz"
    save_recording(recorded, path)
    for name, value in load_recording(path)._asdict().items():
        np.testing.assert_equal(value, getattr(recorded, name), err_msg=name)

    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InvalidValueError, match="delete it to make it again"):
        load_recording(path)


def test_a_damaged_or_wrong_policy_file_is_refused_with_the_reason(tmp_path):
    torch = pytest.importorskip("torch")
    from safetensors.torch import save_file

    from roboirg_learn.trained_file import DESCRIPTION, load_trained, save_trained

    path = tmp_path / "a.body"
    path.write_bytes(b"nothing")
    with pytest.raises(InvalidValueError, match="it is damaged, or was not"):
        load_trained(path, "body", list)
    for description, words in (
        ({}, "it is damaged"),
        ({"kind": "body", "format": 0}, "it is a body of format 0"),
        ({"kind": "reader", "format": 1}, "it is a reader of format 1"),
        ({"kind": "body", "format": 1}, "it is damaged"),
    ):
        save_file({"a": torch.zeros(1)}, path, {DESCRIPTION: json.dumps(description)})
        with pytest.raises(InvalidValueError, match=words):
            load_trained(path, "body", lambda file: file.about["plan"])
    save_trained("body", {"plan": {}}, torch.nn.ModuleDict(), {"a": torch.zeros(1)}, path)
    assert load_trained(path, "body", lambda file: file.about["plan"]) == {}


def test_the_version_of_a_trained_file_depends_on_plan_and_weights_only(tmp_path):
    """Else a file that is written anew would be another policy, or one trained anew the same."""
    torch = pytest.importorskip("torch")
    from roboirg_learn.trained_file import TrainedFile, load_trained, save_trained

    def version(plan, weight, name="heights", **more):
        path = tmp_path / "a.body"
        nets = torch.nn.ModuleDict({"net": torch.nn.Linear(1, 1)})
        torch.nn.init.constant_(nets["net"].weight, weight)
        torch.nn.init.zeros_(nets["net"].bias)
        save_trained("body", {"plan": plan, **more}, nets, {name: torch.zeros(2)}, path)
        return load_trained(path, "body", lambda file: file).version

    first = version({"seed": 0, "tasks": ["BinFill"]}, 1.0)

    assert version({"tasks": ["BinFill"], "seed": 0}, 1.0, moves=[1]) == first

    others = [
        version({"seed": 1, "tasks": ["BinFill"]}, 1.0),
        version({"seed": 0, "tasks": ["BinFill"]}, 2.0),
        version({"seed": 0, "tasks": ["BinFill"]}, 1.0, "depths"),
    ]
    assert len({first, *others}) == 4

    row = torch.zeros(1, 2)
    column = torch.zeros(2, 1)
    assert TrainedFile({"plan": {}}, {"a": row}).version != (
        TrainedFile({"plan": {}}, {"a": column}).version
    )


@settings(max_examples=25)
@given(st.lists(st.sampled_from(["PickXtimes", "BinFill", "StopCube"]), max_size=90))
def test_each_task_has_decisions_for_training_and_some_held_back_for_checking(tasks):
    pytest.importorskip("torch")
    from roboirg_learn.policy.body_training import VALIDATION_EVERY, validation_flags

    found = list(zip(tasks, validation_flags(tasks), strict=True))
    for task in set(tasks):
        own = [is_held for decision_task, is_held in found if decision_task == task]
        assert not own[0]
        assert sum(own) == (len(own) + VALIDATION_EVERY - 2) // VALIDATION_EVERY


def error_of_learning(*options, what="policy"):
    """Return the error of the command with wrong options."""
    pytest.importorskip("torch")
    done = CliRunner().invoke(app, ["learn", what, *map(str, options)])
    assert isinstance(done.exception, InvalidValueError), done.output
    return str(done.exception)


def test_impossible_training_options_are_refused_before_anything_is_recorded(tmp_path, monkeypatch):
    pytest.importorskip("torch")
    from roboirg_learn.listener.encoders import ENCODERS, TokenEncoder

    class PixelEncoder(TokenEncoder):
        reads_pixels = True

        def __init__(self, vocabulary):
            super().__init__()

    monkeypatch.setitem(ENCODERS, "pixels", PixelEncoder)
    out = tmp_path / "policy"
    (tmp_path / "file").touch()

    for place, options, words in (
        (out, ("--tasks", "StopCube", "--settings", "spatial"), "None of these tasks has the"),
        (out, ("--plan", plan_file(training={"encoders": {"bert": {}}})), "no encoder 'bert'"),
        (out, ("--plan", plan_file(training={"encoders": {"pixels": {}}})), "reader has none"),
        (out, ("--paper", "--memory", "none"), "training.memories"),
        (tmp_path / "file", (), "is a file; --out needs a folder"),
        (tmp_path / "file" / "policy", (), "Cannot write"),
    ):
        assert words in error_of_learning(*options, "--out", place)
    with locked(out / ".lock", "held"):
        assert "Another command learns in" in error_of_learning("--out", out)
    assert not (out / "recordings").exists()


BODY = "recurrent-0.body.safetensors"
READER = "explicit-0.reader.safetensors"
SHORT_TRAINING = {
    "scenes": 3,
    "drawn": 2,
    "detector_epochs": 1,
    "body_epochs": 2,
    "reader_epochs": 1,
}


@pytest.fixture(scope="module")
def folder_of_policy(tmp_path_factory):
    """A policy that has hardly learned, made by the command."""
    pytest.importorskip("torch")
    folder_of_policy = tmp_path_factory.mktemp("policy")
    plan = plan_file(training=SHORT_TRAINING)
    call = [
        "learn",
        "policy",
        "--tasks",
        "ButtonUnmask",
        "--out",
        str(folder_of_policy),
        "--plan",
        plan,
    ]
    done = CliRunner().invoke(app, [*call, "--workers", "0"])
    assert done.exit_code == 0, done.output
    assert PolicyFiles(folder_of_policy / BODY, folder_of_policy / READER).spec in done.output
    return folder_of_policy, call


@pytest.mark.sim
@pytest.mark.slow
def test_the_command_learn_makes_a_policy_that_plays_from_pictures_alone(
    folder_of_policy, tmp_path
):
    spec = PolicyFiles(folder_of_policy[0] / BODY, folder_of_policy[0] / READER).spec
    assert (read_policy(spec).is_privileged, read_policy(spec).is_hosted) == (False, True)
    assert read_policy(spec).needs.trained_tasks == ("ButtonUnmask",)
    assert not hasattr(make_policy(spec, 0), "attach")

    out = tmp_path / "runs"
    call = ["run", "--policy", spec, "--tasks", "ButtonUnmask", "--settings", "explicit,direct"]
    done = CliRunner().invoke(app, [*call, "--episodes", "1", "--out", str(out)])
    assert done.exit_code == 0, done.output

    played = read_records(next(out.rglob("records.jsonl")).parent)
    memories = [
        (record.error, record.policy_metadata["trained"]["body"]["memory"]) for record in played
    ]
    assert memories == [(None, "recurrent")] * 2

    curve = json.loads((folder_of_policy[0] / "body-recurrent-0.json").read_text())
    assert [line["epoch"] for line in curve] == [1, 2]


@pytest.mark.sim
@pytest.mark.slow
def test_learning_again_reuses_files_and_refuses_those_of_another_plan(folder_of_policy):
    place, (*call, plan) = folder_of_policy
    before = {path: path.stat().st_mtime_ns for path in place.rglob("*.*")}
    for options, words in (
        (["--tasks", "PickXtimes", *call[4:], plan, "--memory", "none"], "recordings with tasks"),
        ([*call[2:-1], "--memory", "none"], "recordings with drawn 2, not 300"),
        (
            [*call[2:], plan_file(training=SHORT_TRAINING | {"body_epochs": 3})],
            "was trained by another plan",
        ),
    ):
        assert words in error_of_learning(*options)

    other = ["--body", place / BODY, "--out", place / "new", "--tasks", "BinFill"]
    assert "no task of this body 'BinFill'" in error_of_learning(*other, what="reader")

    done = CliRunner().invoke(app, [*call, plan, "--memory", "none", "--settings", "none"])
    assert done.exit_code == 0, done.output
    assert (place / "none-0.body.safetensors").exists()
    assert (place / "none-0.reader.safetensors").exists()
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.mark.sim
def test_a_reader_is_trained_for_an_existing_body_without_new_recordings(tmp_path):
    """A reader turns words into a goal, a body acts on it.

    No expert plays, and a command that was killed trains only the passes that are left.
    """
    pytest.importorskip("torch")
    from roboirg_learn.policy.trained_body import load_body
    from roboirg_learn.policy.trained_reader import load_reader

    out = tmp_path / "new.reader"
    few = plan_file(training={"scenes": 2, "reader_epochs": 2})
    call = ["learn", "reader", "--body", str(SHIPPED.body), "--out", str(out), "--plan", few]
    call += ["--tasks", "StopCube", "--settings", "explicit,direct", "--workers", "0"]
    whole = CliRunner().invoke(app, call)
    assert whole.exit_code == 0, whole.output
    assert PolicyFiles(SHIPPED.body, out).spec in whole.output
    reader = load_reader(out)
    body = load_body(SHIPPED.body)
    assert (reader.plan["tasks"], reader.plan["body"]) == (["StopCube"], body.version)
    assert reader.vocabulary.classes == body.object_classes.names
    assert reader.vocabulary[2:] == (body.goals.tasks, body.goals.parts)
    assert not list(tmp_path.rglob("recordings"))
    out.unlink()
    again = CliRunner().invoke(app, call)
    assert again.exit_code == 0, again.output
    assert "reader: 1 of 2" not in again.output
    assert load_reader(out).version == reader.version


def test_the_command_printed_after_training_is_a_valid_run(capsys):
    """Names of all settings are refused where a task lacks one of them."""
    plan = ReaderPlan(("StopCube", "BinFill"), tuple(plain_settings()))
    print_policy(PolicyFiles(Path("a"), Path("my b")), plan)
    words = shlex.split(capsys.readouterr().out.partition("roboirg run ")[2])
    options = dict(zip(words[::2], words[1::2], strict=True))

    assert options["--policy"] == "trained:a?reader=my%20b"

    make_plan(policies=["oracle"], tasks=plan.tasks, settings=options["--settings"], split="val")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--body", "none"), "'none' is no trained body"),
        (("--tasks", "PickUp"), "no task 'PickUp'"),
        (("--settings", "never"), "no setting 'never'"),
    ],
)
def test_wrong_options_for_training_a_reader_are_refused_before_anything_is_written(
    options, words, tmp_path
):
    given = ["--body", SHIPPED.body, "--out", tmp_path / "a", *options]
    assert words in error_of_learning(*given, what="reader")
    assert not list(tmp_path.iterdir())


def test_a_reader_trained_for_other_objects_or_goals_is_refused_by_a_body(tmp_path):
    """Else it would name numbers that mean something else to the body."""
    pytest.importorskip("torch")
    from untrained import reader_for

    from roboirg_learn.policy.policy_model import load_policy
    from roboirg_learn.policy.trained_body import GoalLayout, load_body
    from roboirg_learn.policy.trained_reader import save_reader

    body = load_body(SHIPPED.body)
    files = PolicyFiles(SHIPPED.body, tmp_path / "a.reader")
    parts = body.goals.parts
    for classes, goals in (
        (body.object_classes.names[1:], body.goals),
        (body.object_classes.names, GoalLayout(body.goals.tasks[::-1], parts)),
        (body.object_classes.names, GoalLayout(body.goals.tasks, ("color=pink", *parts))),
    ):
        save_reader(reader_for(classes, goals), files.reader)
        with pytest.raises(InvalidValueError, match="does not fit the body"):
            load_policy(files)
    save_reader(reader_for(body.object_classes.names, body.goals), files.reader)
    assert load_policy(files).reader.vocabulary.tasks == body.goals.tasks
