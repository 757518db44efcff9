"""The policy that learns to act: what it is recorded from, its file, its command, and its play."""

import json
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from page_text import call
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg.core.errors import InvalidValueError
from roboirg.extension.sight import ExpertRecording, record_expert
from roboirg.language.settings import plain_settings
from roboirg.main import app
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

WEIGHTS = Path(__file__).parents[3] / "results" / "weights"
SHIPPED = PolicyFiles(
    WEIGHTS / "recurrent-0.body.safetensors", WEIGHTS / "all-0.reader.safetensors"
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
    """A policy is named by a scheme, a file and options, as in ``trained:BODY?reader=FILE``."""
    pytest.importorskip("torch")
    with pytest.raises(InvalidValueError, match=words):
        make_policy(spec, 0)


@pytest.fixture(scope="module")
def recorded():
    return record_expert(get_episode("ButtonUnmask", "random", 0))


@pytest.mark.sim
def test_the_expert_succeeds_although_its_motion_is_disturbed(recorded):
    """Recordings disturb the arm so that a policy learns to recover."""
    plain = record_expert(get_episode("ButtonUnmask", "random", 0), disturbed=False)

    assert recorded.status == "success"
    length = min(len(plain.tool), len(recorded.tool))
    assert not np.array_equal(plain.tool[:length], recorded.tool[:length])


@pytest.mark.sim
def test_recorded_waypoints_at_an_object_are_exact_though_the_motion_was_disturbed(recorded):
    """`recorded` is an episode of the expert, in which the arm was pushed off its way.

    Of all waypoints that go to an object, x and y lie within 2 cm of the object's place at that
    look: what is learned is where the expert wanted to go, not where it was pushed.
    """
    looks = recorded.looks.tolist()
    at_objects = [decision for decision in decisions_of(recorded) if decision.move.at_object]

    assert at_objects
    for decision in at_objects:
        x, y, *_ = recorded.things[decision.look, decision.object_number]
        action = recorded.actions[looks.index(decision.look)]
        assert np.hypot(action[0] - x, action[1] - y) < 0.02, decision


@pytest.mark.sim
def test_recorded_grasps_are_of_the_containers_over_the_goal_s_cubes(recorded):
    """The goal names colors of cubes, each hidden by a container; a move that aligns is a grasp."""
    episode = get_episode("ButtonUnmask", "random", 0)

    grasped = set()
    for decision in decisions_of(recorded):
        if decision.move.turn == "align":
            grasped.add(recorded.names[decision.object_number])

    colors = episode.goal.texts("colors")
    assert grasped == {item.inside for item in episode.scene.objects if item.color in colors}


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
    """The hand goes above, down, down again, closes, and goes up: five looks, 0 to 4.

    Waypoints are x, y, z, roll, pitch, yaw and gripper (-1 closes). Going down, down again and
    closing have the same place: the two that go down are labeled with the closing that follows,
    which is no decision of its own. So four are left.
    """
    down = [0, 0, 0.02, 0, 0, 0, 0]
    close = [0, 0, 0.02, 0, 0, 0, -1]
    above = [0, 0, 0.15, 0, 0, 0, 0]

    found = decisions_of(recording_with_actions([above, down, down, close, above], [0, 1, 2, 3, 4]))

    assert [decision.look for decision in found] == [0, 1, 2, 4]
    assert [decision.move.gripper for decision in found] == [0, -1, -1, 0]


def test_passes_of_a_moving_cube_over_its_target_are_counted_at_each_look():
    """A moving cube is of the class *shuttle*. It moves along x, and the target stays at 0.

    At five looks it is at -3, -1, 2, 1 and -1: it passes between the second and third look, and
    back between the last two.
    """
    things = np.zeros((5, 2, 4))  # looks, objects, and x, y, z, yaw of each
    things[:, 0, 0] = [-3, -1, 2, 1, -1]
    recorded = recording_with_actions([np.zeros(7)], looks=[4])
    moving = recorded._replace(classes=("shuttle", "target"), things=things)

    assert passes_so_far(moving).tolist() == [0, 0, 1, 1, 2]


def test_without_a_moving_cube_no_passes_are_counted():
    """At each of five looks there is no label, as opposed to no pass."""
    recorded = recording_with_actions([np.zeros(7)], looks=[4])

    assert passes_so_far(recorded).tolist() == [NO_LABEL] * 5


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
    """A picture is moved and perhaps mirrored at random; its label has to follow.

    The one white pixel is the labeled object, turned by 0.2 rad. It stands on the left, column 50
    of 256, so that a mirrored picture has it on the right, beyond 128, with the turn reversed. The
    middle of a pixel is half a pixel from its corner.
    """
    pytest.importorskip("torch")
    from roboirg_learn.policy.object_detector import LabeledPicture, augmented

    picture = np.zeros((256, 256, 3), np.uint8)
    picture[100, 50] = 255
    yaw_codes = encode_yaws(np.array([0.2]))
    view = LabeledPicture(picture, np.array([0]), np.array([[50.5, 100.5]]), yaw_codes)

    found = augmented(view, np.random.default_rng(seed))

    ((row, column),) = np.argwhere(found.picture[..., 0] == 255)
    yaw = -0.2 if column > 128 else 0.2
    assert found.points.tolist() == [[column + 0.5, row + 0.5]]
    assert np.allclose(found.yaw_codes, encode_yaws(np.array([yaw])))


@pytest.mark.sim
def test_a_recording_notes_how_many_stages_are_done(recorded):
    """It begins with none, never falls, and ends with all stages or all but the last."""
    stages = len(get_episode("ButtonUnmask", "random", 0).stages)

    assert recorded.done[0] == 0
    assert (np.diff(recorded.done) >= 0).all()
    assert recorded.done[-1] in (stages - 1, stages)


@pytest.mark.sim
def test_a_recording_notes_which_objects_are_visible(recorded):
    """The expert was recorded in ButtonUnmask, where containers come down over cubes.

    At the first look only the cubes are visible, from control step 40 on only the containers.
    """
    cubes = np.array([name.startswith("cube") for name in recorded.classes])
    containers = np.array([name == "container" for name in recorded.classes])
    covered = int(np.flatnonzero(recorded.steps >= 40)[0])

    assert recorded.visible[0, cubes].all()
    assert not recorded.visible[0, containers].any()
    assert not recorded.visible[covered, cubes].any()
    assert recorded.visible[covered, containers].all()


@pytest.mark.sim
def test_a_recording_is_read_as_it_was_written(recorded, tmp_path):
    """All its fields are equal, arrays value by value."""
    save_recording(recorded, tmp_path / "one.npz")

    loaded = load_recording(tmp_path / "one.npz")

    for name, value in loaded._asdict().items():
        np.testing.assert_equal(value, getattr(recorded, name), err_msg=name)


def test_a_recording_that_is_cut_off_is_refused_with_what_to_do(tmp_path):
    """The file has only the first bytes of an archive, as after a full disk."""
    path = tmp_path / "one.npz"
    path.write_bytes(b"PK\x03\x04")

    with pytest.raises(InvalidValueError, match="delete it to make it again"):
        load_recording(path)


@pytest.mark.parametrize(
    ("description", "words"),
    [
        ({}, "it is damaged"),
        ({"kind": "body", "format": 0}, "it is a body of format 0"),
        ({"kind": "reader", "format": 1}, "it is a reader of format 1"),
        ({"kind": "body", "format": 1}, "it is damaged"),
    ],
    ids=["no description", "earlier format", "a reader", "no plan"],
)
def test_a_wrong_file_of_a_body_is_refused_with_the_reason(tmp_path, description, words):
    """The description in a file has its kind, the version of its format (1), and the plan.

    Each of the given descriptions lacks one of them, or has another one.
    """
    torch = pytest.importorskip("torch")
    from safetensors.torch import save_file

    from roboirg_learn.trained_file import DESCRIPTION, load_trained

    path = tmp_path / "a.body"
    save_file({"a": torch.zeros(1)}, path, {DESCRIPTION: json.dumps(description)})

    with pytest.raises(InvalidValueError, match=words):
        load_trained(path, "body", lambda file: file.about["plan"])


def test_a_file_that_was_never_a_trained_one_is_refused(tmp_path):
    """The file has the seven bytes "nothing"."""
    pytest.importorskip("torch")
    from roboirg_learn.trained_file import load_trained

    path = tmp_path / "a.body"
    path.write_bytes(b"nothing")

    with pytest.raises(InvalidValueError, match="it is damaged, or was not"):
        load_trained(path, "body", list)


@pytest.fixture
def version_of(tmp_path):
    """A function that writes a trained file and returns its version.

    It takes the plan, the only weight of the network, and the name of a table of numbers.
    """
    torch = pytest.importorskip("torch")
    from roboirg_learn.trained_file import load_trained, save_trained

    def version(plan, weight, name="heights", **more):
        path = tmp_path / "a.body"
        nets = torch.nn.ModuleDict({"net": torch.nn.Linear(1, 1, bias=False)})
        torch.nn.init.constant_(nets["net"].weight, weight)
        save_trained("body", {"plan": plan, **more}, nets, {name: torch.zeros(2)}, path)
        return load_trained(path, "body", lambda file: file).version

    return version


def test_the_version_of_a_trained_file_depends_on_plan_and_weights_only(version_of):
    """Else a file that is written anew would be another policy: in another order, with more."""
    first = version_of({"seed": 0, "tasks": ["BinFill"]}, 1.0)

    assert version_of({"tasks": ["BinFill"], "seed": 0}, 1.0, moves=[1]) == first


def test_another_plan_weight_or_table_is_another_version(version_of):
    versions = {
        version_of({"seed": 0}, 1.0),
        version_of({"seed": 1}, 1.0),
        version_of({"seed": 0}, 2.0),
        version_of({"seed": 0}, 1.0, "depths"),
    }

    assert len(versions) == 4


def test_the_same_numbers_in_another_shape_are_another_version():
    """Two zeros in a row or in a column: a version is of weights and their shapes."""
    torch = pytest.importorskip("torch")
    from roboirg_learn.trained_file import TrainedFile

    row = TrainedFile({"plan": {}}, {"a": torch.zeros(1, 2)})
    column = TrainedFile({"plan": {}}, {"a": torch.zeros(2, 1)})

    assert row.version != column.version


def test_of_ten_episodes_of_a_task_the_second_is_held_back_for_checking():
    """Tasks are counted apart; a task with one episode has it for training."""
    pytest.importorskip("torch")
    from roboirg_learn.policy.body_training import validation_flags

    flags = validation_flags(["BinFill", "StopCube", *["BinFill"] * 11])

    assert flags == [False, False, True, *[False] * 9, True]


def error_of_learning(*options, what="policy"):
    """Return the error of the command with wrong options."""
    pytest.importorskip("torch")
    done = CliRunner().invoke(app, ["learn", what, *map(str, options)])
    assert isinstance(done.exception, InvalidValueError), done.output
    return str(done.exception)


@pytest.fixture
def encoder_of_pixels(monkeypatch):
    """An encoder named "pixels", which needs pictures and not only words."""
    pytest.importorskip("torch")
    from roboirg_learn.listener.encoders import ENCODERS, TokenEncoder

    class PixelEncoder(TokenEncoder):
        reads_pixels = True

        def __init__(self, vocabulary):
            super().__init__()

    monkeypatch.setitem(ENCODERS, "pixels", PixelEncoder)


@pytest.mark.usefixtures("encoder_of_pixels")
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--tasks", "StopCube", "--settings", "spatial"), "None of these tasks has the"),
        (("--plan", plan_file(training={"encoders": {"bert": {}}})), "no encoder 'bert'"),
        (("--plan", plan_file(training={"encoders": {"pixels": {}}})), "reader has none"),
    ],
    ids=["setting", "unknown encoder", "encoder of pixels"],
)
def test_impossible_training_options_are_refused_before_anything_is_recorded(
    tmp_path, options, words
):
    assert words in error_of_learning(*options, "--out", tmp_path / "policy")
    assert not (tmp_path / "policy" / "recordings").exists()


@pytest.mark.parametrize(
    ("place", "words"),
    [("file", "is a file; --out needs a folder"), ("file/policy", "Cannot write")],
)
def test_a_place_where_no_folder_can_be_made_is_refused_before_training(tmp_path, place, words):
    (tmp_path / "file").touch()

    assert words in error_of_learning("--out", tmp_path / place)


def test_a_folder_in_which_another_command_learns_is_refused(tmp_path):
    with locked(tmp_path / ".lock", "held"):
        assert "Another command learns in" in error_of_learning("--out", tmp_path)


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
    """The folder of a policy for ButtonUnmask that has hardly learned, in which a command trained.

    It was trained in 2 passes, with 2 drawn scenes, and has a recurrent memory.
    """
    pytest.importorskip("torch")
    folder = tmp_path_factory.mktemp("policy")
    plan = plan_file(training=SHORT_TRAINING)
    words = f"learn policy --tasks ButtonUnmask --out {folder} --plan {plan} --workers 0"
    printed = call(*words.split())
    assert PolicyFiles(folder / BODY, folder / READER).spec in printed
    return folder


@pytest.mark.parametrize(("moved", "looks"), [(0, 1), (1, 2)])
def test_a_robot_that_waits_looks_again_if_anything_else_has_moved(moved, looks):
    """Joints and gripper are as before; a cube that moves by itself changes the picture alone."""
    from roboirg_learn.policy.learned_policy import LearnedPolicy

    policy = LearnedPolicy(MagicMock())
    policy.seen = MagicMock()
    before = {
        "joint_positions": np.zeros(7),
        "gripper": np.zeros(2),
        "end_effector": np.zeros(6),
        "front_rgb": np.zeros((256, 256, 3), np.uint8),
    }
    now = {**before, "front_rgb": before["front_rgb"] + moved}

    policy.watch({**now, "history": [before]})

    pictures, _tools = policy.seen.look.call_args.args
    assert len(pictures) == looks


@pytest.mark.sim
@pytest.mark.slow
def test_a_trained_policy_reads_no_state_of_the_simulator(folder_of_policy):
    """A command trained it for ButtonUnmask. It is not privileged, and not attached to a world.

    So it can run in a process of its own (hosted).
    """
    spec = PolicyFiles(folder_of_policy / BODY, folder_of_policy / READER).spec

    ref = read_policy(spec)

    assert (ref.is_privileged, ref.is_hosted) == (False, True)
    assert ref.needs.trained_tasks == ("ButtonUnmask",)
    assert not hasattr(make_policy(spec, 0), "attach")


@pytest.mark.sim
@pytest.mark.slow
def test_a_trained_policy_plays_and_its_records_say_what_memory_it_has(folder_of_policy, tmp_path):
    """It plays one episode in two settings, as any policy does: without an error.

    A command trained it with the usual memory, a recurrent network.
    """
    spec = PolicyFiles(folder_of_policy / BODY, folder_of_policy / READER).spec
    words = f"run --policy {spec} --tasks ButtonUnmask --settings explicit,direct --episodes 1"

    call(*words.split(), "--out", tmp_path)

    first, second = read_records(next(tmp_path.rglob("records.jsonl")).parent)
    assert first.error is second.error is None
    assert first.policy_metadata["trained"]["body"]["memory"] == "recurrent"


@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "training", "reason"),
    [
        ("--tasks PickXtimes --memory none", {}, "recordings with tasks"),
        ("--tasks ButtonUnmask --memory none", {"drawn": 300}, "recordings with drawn 2, not 300"),
        ("--tasks ButtonUnmask", {"body_epochs": 3}, "was trained by another plan"),
    ],
    ids=["other tasks", "more drawn scenes", "more passes"],
)
def test_learning_in_a_folder_with_files_of_another_plan_is_refused(
    folder_of_policy, options, training, reason
):
    """In the folder a policy was trained for ButtonUnmask, in 2 passes and with 2 drawn scenes.

    A policy without memory could use its recordings, but not with other tasks or scenes. With more
    passes the trained body itself would be another one.
    """
    plan = plan_file(training=SHORT_TRAINING | training)

    error = error_of_learning(*options.split(), "--out", folder_of_policy, "--plan", plan)

    assert reason in error


@pytest.mark.sim
@pytest.mark.slow
def test_a_reader_for_a_task_that_the_body_does_not_know_is_refused(folder_of_policy):
    """The body was trained for ButtonUnmask alone."""
    body = folder_of_policy / BODY

    error = error_of_learning(
        "--body", body, "--out", folder_of_policy / "new", "--tasks", "BinFill", what="reader"
    )

    assert "no task of this body 'BinFill'" in error


@pytest.mark.sim
@pytest.mark.slow
def test_a_second_policy_in_a_folder_writes_no_file_of_the_first_again(folder_of_policy):
    """The second has the same plan, but no memory, and hears no settings but explicit (none).

    It uses the recordings of the first: no time of change of the files that were there moves.
    """
    before = {path: path.stat().st_mtime_ns for path in folder_of_policy.rglob("*.*")}
    plan = plan_file(training=SHORT_TRAINING)
    words = "learn policy --tasks ButtonUnmask --memory none --settings none --workers 0"

    call(*words.split(), "--out", folder_of_policy, "--plan", plan)

    assert (folder_of_policy / "none-0.body.safetensors").exists()
    assert (folder_of_policy / "none-0.reader.safetensors").exists()
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.fixture(scope="module")
def trained_reader_file(tmp_path_factory):
    """A reader that hardly learned, for the shipped body: its file and the command that made it."""
    pytest.importorskip("torch")
    out = tmp_path_factory.mktemp("reader") / "new.reader"
    plan = plan_file(training={"scenes": 2, "reader_epochs": 2})
    words = ["learn", "reader", "--tasks", "StopCube", "--settings", "explicit,direct"]
    words += ["--workers", "0", "--body", SHIPPED.body, "--out", out, "--plan", plan]
    assert PolicyFiles(SHIPPED.body, out).spec in call(*words)
    return out, words


@pytest.mark.sim
def test_a_reader_is_trained_for_an_existing_body_without_new_recordings(
    trained_reader_file, shipped_body
):
    """A body acts on a goal, given as numbers; a reader is trained apart to turn words into them.

    The fixture trained one on StopCube for the body that comes with the benchmark. The file says
    for which body it is, and has the body's own lists of objects, tasks and parts of goals. No
    expert had to play: there are no recordings next to it.
    """
    from roboirg_learn.policy.trained_reader import load_reader

    out, _ = trained_reader_file

    reader = load_reader(out)

    assert reader.plan["tasks"] == ["StopCube"]
    assert reader.plan["body"] == shipped_body.version
    assert reader.vocabulary.classes == shipped_body.object_classes.names
    assert reader.vocabulary.tasks == shipped_body.goals.tasks
    assert reader.vocabulary.parts == shipped_body.goals.parts
    assert not list(out.parent.rglob("recordings"))


@pytest.mark.sim
def test_a_reader_whose_file_is_lost_is_made_again_without_training(trained_reader_file):
    """The fixture trained a reader in two passes by a command, which is given again.

    It keeps the weights of each pass in a folder of its work, so that no pass is left to train:
    there is no line of progress such as "reader: 1 of 2", and the file is the same version again.
    """
    from roboirg_learn.policy.trained_reader import load_reader

    out, command = trained_reader_file
    version = load_reader(out).version
    out.unlink()

    printed = call(*command)

    assert "reader: 1 of 2" not in printed
    assert load_reader(out).version == version


def test_the_command_printed_after_training_is_a_valid_run(capsys):
    """The reader was trained on all plain settings, of which StopCube lacks one, *spatial*.

    A run with the names of these settings would be refused; the printed command says "all", which a
    plan can be made of. The blank in the name of a file is escaped.
    """
    trained = ReaderPlan(("StopCube", "BinFill"), tuple(plain_settings()))

    print_policy(PolicyFiles(Path("a"), Path("my b")), trained)

    printed = capsys.readouterr().out
    assert "roboirg run --policy 'trained:a?reader=my%20b' --tasks StopCube,BinFill" in printed
    assert "--split val --settings all" in printed
    plan = make_plan(policies=["oracle"], tasks=trained.tasks, settings="all", split="val")
    assert plan.tasks == ("StopCube", "BinFill")


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
    """The options replace good ones; the message names the wrong one, and nothing is written."""
    given = ["--body", SHIPPED.body, "--out", tmp_path / "a", *options]
    assert words in error_of_learning(*given, what="reader")
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def shipped_body():
    pytest.importorskip("torch")
    from roboirg_learn.policy.trained_body import load_body

    return load_body(SHIPPED.body)


def policy_with_reader(folder, classes, tasks, parts):
    """Load the shipped body with a reader that has learned nothing.

    Args:
        folder: where the reader is stored.
        classes: the objects that it knows.
        tasks: the tasks whose goals it names.
        parts: the parts of these goals, such as "color=red".
    """
    from untrained import reader_for

    from roboirg_learn.policy.policy_model import load_policy
    from roboirg_learn.policy.trained_body import GoalLayout
    from roboirg_learn.policy.trained_reader import save_reader

    files = PolicyFiles(SHIPPED.body, folder / "a.reader")
    save_reader(reader_for(classes, GoalLayout(tasks, parts)), files.reader)
    return load_policy(files)


@pytest.mark.parametrize("difference", ["objects", "order of tasks", "parts of goals"])
def test_a_reader_trained_for_other_objects_or_goals_is_refused_by_a_body(
    shipped_body, tmp_path, difference
):
    """Else it would name numbers that mean something else to the body."""
    classes = shipped_body.object_classes.names
    goals = shipped_body.goals
    layouts = {
        "objects": (classes[1:], goals.tasks, goals.parts),
        "order of tasks": (classes, goals.tasks[::-1], goals.parts),
        "parts of goals": (classes, goals.tasks, ("color=pink", *goals.parts)),
    }

    with pytest.raises(InvalidValueError, match="does not fit the body"):
        policy_with_reader(tmp_path, *layouts[difference])


def test_a_reader_trained_for_the_objects_and_goals_of_a_body_fits_it(shipped_body, tmp_path):
    """The same objects, tasks and parts of goals in the same order."""
    goals = shipped_body.goals

    policy = policy_with_reader(
        tmp_path, shipped_body.object_classes.names, goals.tasks, goals.parts
    )

    assert policy.reader.vocabulary.tasks == goals.tasks
