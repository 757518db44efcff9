"""Subgoals as numbers, what a planner keeps, and hands that follow any planner."""

import numpy as np
import pytest

from roboirg.core.subgoal_text import split_point
from roboirg.extension.sight import ExpertRecording, points_of
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.policy.planner_history import (
    MAX_CHOSEN,
    MAX_SWITCHES,
    RECENT,
    VIDEO_FRAMES,
    KeyframeHistory,
    PlannerHistory,
    ideal_planner_inputs,
    recent_looks,
)
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.subgoals import (
    MOST_POINT_NOISE,
    REQUEST_WORDS,
    SubgoalTemplate,
    encode_request,
    recorded_subgoals,
    subgoals_due,
    templates_of,
)

OBJECTS = ObjectClasses(
    ("button", "container", "cube blue", "cube green", "cube red", "target"),
    np.array([0.01, 0.05, 0.02, 0.02, 0.02, 0.0]),
)


@pytest.mark.parametrize("task", sorted(all_tasks()))
def test_every_subgoal_of_a_task_is_encoded_with_its_motion(task):
    """Learned hands read a subgoal as numbers, one of which marks the motion."""
    for number in range(10):
        for stage in get_episode(task, "train", number).stages:
            subgoal = SubgoalTemplate(stage.subgoal).at(np.array([100.0, 90.0]))
            found = encode_request(subgoal, OBJECTS)
            assert found is not None, subgoal
            assert found[REQUEST_WORDS.index(stage.primitive.kind.removesuffix("_until"))] or (
                stage.primitive.kind == "press_below"
            )


def test_a_point_in_a_subgoal_is_encoded_as_the_place_on_the_table():
    place = np.array([-0.05, 0.11, 0.02])
    subgoal = SubgoalTemplate("pick up the red cube {at}").at(points_of(place))
    assert split_point(subgoal)[1] is not None

    found = encode_request(subgoal, OBJECTS)
    assert found[-3] == 1
    assert np.allclose(found[-2:], place[:2], atol=0.004)
    assert encode_request("pick up the red cube", OBJECTS)[-3] == 0
    assert encode_request("make me a sandwich", OBJECTS) is None


def recording_of(episode, done):
    """Return a recording in which every object moves a little at each look."""
    names = tuple(item.name for item in episode.scene.objects)
    looks = len(done)
    rng = np.random.default_rng(0)
    things = np.zeros((looks, len(names), 4), np.float32)
    things[..., :2] = (
        rng.uniform(-0.1, 0.1, (len(names), 2)) + np.arange(looks)[:, None, None] / 500
    )
    empty = np.zeros(looks, np.int32)
    return ExpertRecording(
        episode.key, names, names, things, np.ones(things.shape[:2], bool),
        np.zeros((looks, 7), np.float32), empty.astype(bool), empty, np.array(done, np.int32),
        np.arange(looks), np.zeros((looks, 7), np.float32), empty, ("keep",) * looks, {}, "success",
    )  # fmt: skip


def test_recordings_give_the_due_subgoal_with_the_point_at_its_start():
    """The first two looks are of stage 0, the others of stage 1; objects move on meanwhile."""
    episode = get_episode("PickXtimes", "train", 0)
    done = [0, 0, 1, 1, 1]
    stages = [episode.stages[number] for number in done]
    recorded = recording_of(episode, done)

    due = subgoals_due(recorded, episode, range(5))
    exact = recorded_subgoals(recorded, episode, done, None)

    assert [decision.move.words for decision in due] == [stage.subgoal for stage in stages]
    names = [recorded.names[decision.object_number] for decision in due]
    assert names == [stage.points_at for stage in stages]
    assert exact[0] == exact[1] != exact[2] == exact[3] == exact[4]
    wanted = points_of(recorded.things[2, due[2].object_number, :3].astype(float))
    assert np.abs(np.array(split_point(exact[2])[1])[::-1] - wanted).max() <= 0.5

    moved = recorded_subgoals(recorded, episode, done, np.random.default_rng(0))
    away = np.subtract(split_point(moved[2])[1], split_point(exact[2])[1])
    assert 0 < np.abs(away).max() <= MOST_POINT_NOISE + 1


def test_planner_history_keeps_the_looks_at_which_the_subgoal_changed():
    """Subgoal templates are numbered; 0 is due at looks 2 and 4, 1 at 7, 0 again at 9."""
    history = PlannerHistory(3)
    for template, look in ((0, 2), (0, 4), (1, 7), (0, 9)):
        history.name(template, look)
    assert history.switches == [2, 7, 9]

    # At look 19, of three templates: how often each was done, which is under way, and since when.
    done, under_way, rest = np.split(history.context(19), [3, 6])
    assert done.tolist() == [1, 1, 0]
    assert under_way.tolist() == [1, 0, 0]
    assert rest.tolist() == [0.25, 0, 0, 0]

    kept = history.kept(video=2, look=19)
    assert [look for look in kept if look >= 0] == [0, 1, 2, 7, 9, 19]
    assert len(kept) == VIDEO_FRAMES + MAX_SWITCHES + 1


def test_a_planner_with_key_frames_is_not_told_what_it_named_before():
    """Else it could count by its own words, and key frames could not matter."""
    named = KeyframeHistory(3)
    for template, look in ((0, 2), (1, 7), (0, 9)):
        named.name(template, look)

    assert not len(named.context(19))
    assert named.kept(2, 19).tolist() == KeyframeHistory(3).kept(2, 19).tolist()


def test_neighboring_key_frames_are_merged_into_their_middle_one():
    """Looks are as far apart as the merge rule's gap, so that neighbors join."""
    history = KeyframeHistory(3)
    history.choose([5, 6, 7])
    history.choose([20, 21])
    history.choose([23, 40])
    kept = history.kept(video=0, look=60)

    assert kept[:4].tolist() == [6, 21, 23, 40]
    assert kept[4 : 4 + RECENT].tolist() == recent_looks(60)

    history.choose([22])  # joins what was apart, as of an even group the later one counts
    assert history.kept(video=0, look=60)[:3].tolist() == [6, 22, 40]

    history.choose(range(100, 200, 2))
    assert (history.kept(video=50, look=300) >= 0).sum() == VIDEO_FRAMES + MAX_CHOSEN + RECENT


def test_training_inputs_equal_those_of_a_planner_that_is_always_right():
    templates = np.array([0, 0, 1, 1, 0])
    looks = np.array([1, 4, 6, 9, 12])
    inputs = ideal_planner_inputs(KeyframeHistory(2), templates, looks, 0)
    history = KeyframeHistory(2)
    for number, (template, look) in enumerate(zip(templates, looks, strict=True)):
        assert np.array_equal(inputs.context[number], history.context(look))
        assert np.array_equal(inputs.kept_looks[number], history.kept(0, look))
        history.name(template, look)
        if look in history.switches:
            history.choose([look])

    assert inputs.to_keep[:, -1].tolist() == [1, 0, 1, 0, 1]

    unasked = ideal_planner_inputs(KeyframeHistory(2), np.array([0, -1, 1]), np.array([1, 2, 6]), 0)
    assert (unasked.to_keep[1] == -1).all()
    assert np.array_equal(unasked.context[2], inputs.context[2])
    assert inputs.to_keep[0, :-2].tolist() == [-1] * (RECENT - 2)
    assert [recent_looks(9)[index] for index in np.flatnonzero(inputs.to_keep[3] == 1)] == [6]


@pytest.fixture(params=["subgoal", "keyframes"])
def saved_policy(request, tmp_path):
    """Return the files of a policy with a planner that has learned nothing."""
    torch = pytest.importorskip("torch")
    from untrained import reader_for

    from roboirg_learn.listener.vocabulary import parts_of_tasks
    from roboirg_learn.policy.moves import Move
    from roboirg_learn.policy.object_detector import ObjectDetector
    from roboirg_learn.policy.policy_files import PolicyFiles
    from roboirg_learn.policy.policy_plan import HANDS, BodyPlan
    from roboirg_learn.policy.trained_body import GoalLayout, TrainedBody, make_body, save_body
    from roboirg_learn.policy.trained_reader import save_reader

    torch.manual_seed(0)
    goals = GoalLayout(("PickXtimes",), parts_of_tasks(["PickXtimes"]))
    moves = Move(True, 0.0, 0.0, 0.15, "align", 0.0), Move(False, 0.0, 0.0, 0.1, "keep", 0.0)
    templates = templates_of([get_episode("PickXtimes", "train", 0)])
    acts = make_body(OBJECTS, goals, moves, HANDS)
    plans = make_body(OBJECTS, goals, templates, request.param)
    plan = BodyPlan(goals.tasks, request.param).about
    detector = ObjectDetector(len(OBJECTS.names))
    body = TrainedBody(OBJECTS, detector, goals, moves, acts, plan, templates, plans)
    files = PolicyFiles(tmp_path / "a.body", tmp_path / "a.reader")
    save_body(body, files.body)
    save_reader(reader_for(OBJECTS.names, goals), files.reader)
    return files


def observation_of(seed=0):
    picture = np.random.default_rng(seed).integers(0, 255, (256, 256, 3)).astype(np.uint8)
    tool = np.array([0.0, 0.0, 0.2, np.pi, 0.0, 0.0])
    return {
        "front_rgb": picture, "end_effector": tool, "gripper": np.array([0.04, 0.04]),
        "joint_positions": np.zeros(7), "history": (),
    }  # fmt: skip


NO_VIDEO = {"joint_positions": np.zeros((0, 7))}


@pytest.mark.sim
def test_learned_hands_follow_given_subgoals_or_name_their_own(saved_policy):
    """A subgoal that they cannot read, *sing*, changes nothing."""
    from roboirg.policies.contract.base import SubgoalFollower
    from roboirg_learn.kinds import make_learned

    hands = make_learned(saved_policy)
    assert isinstance(hands, SubgoalFollower)
    hands.reset("pick the cube", NO_VIDEO)
    assert hands.act(observation_of()).shape == (1, 7)
    words = split_point(hands.subgoal)[0]
    assert words in {
        SubgoalTemplate(template.words).at(None) for template in hands.model.body.templates
    }
    hands.follow("press the button at <100, 90>")
    hands.act(observation_of())
    assert hands.subgoal == "press the button at <100, 90>"
    hands.follow("sing")
    assert hands.subgoal == "press the button at <100, 90>"
    hands.reset("pick the cube", NO_VIDEO)
    assert hands.subgoal is None
    hands.follow("sing")
    still = hands.act(observation_of())
    assert np.allclose(still[0], [*observation_of()["end_effector"], 0.0])


@pytest.mark.sim
def test_learned_planners_and_hands_can_be_combined_with_others(saved_policy):
    from roboirg.core.errors import InvalidValueError
    from roboirg.policies.by_name.finding import make_policy, read_policy
    from roboirg_learn.policy.subgoal_following import LearnedHands, LearnedPlanner

    own = saved_policy.spec
    scripted = f"{saved_policy.spec}&hands=scripted"
    assert read_policy(own).is_hosted
    assert not read_policy(own).is_privileged
    assert read_policy(scripted).is_privileged
    assert not read_policy(scripted).is_hosted
    policy = make_policy(scripted, 0)
    assert isinstance(policy.planner, LearnedPlanner)
    assert "front" in policy.cameras
    policy = make_policy(f"planner:oracle?hands={own}", 0)
    assert isinstance(policy.policy, LearnedHands)
    assert policy.actions == "waypoint"
    joints = f"planner:oracle?hands={own}%26actions=joint_angle"
    assert make_policy(joints, 0).actions == "joint_angle"
    with pytest.raises(InvalidValueError, match="other hands"):
        make_policy(f"{scripted}&actions=joint_angle", 0)
    with pytest.raises(InvalidValueError, match="when-done"):
        make_policy(f"planner:stateless?model=none&hands={own}", 0)
