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
)

OBJECTS = ObjectClasses(
    ("button", "container", "cube blue", "cube green", "cube red", "target"),
    np.array([0.01, 0.05, 0.02, 0.02, 0.02, 0.0]),
)


@pytest.mark.parametrize("task", sorted(all_tasks()))
def test_every_subgoal_of_a_task_is_encoded_with_its_motion(task):
    """Learned hands read a subgoal as numbers, one of which marks the motion, such as *pick*.

    The subgoals are those of ten training episodes of the task. The motion is that of its stage;
    *press below* has no number of its own.
    """
    for number in range(10):
        for stage in get_episode(task, "train", number).stages:
            subgoal = SubgoalTemplate(stage.subgoal).at(np.array([100.0, 90.0]))
            found = encode_request(subgoal, OBJECTS)
            assert found is not None, subgoal
            assert found[REQUEST_WORDS.index(stage.primitive.kind.removesuffix("_until"))] or (
                stage.primitive.kind == "press_below"
            )


def test_a_point_in_a_subgoal_is_encoded_as_the_place_on_the_table():
    """The last three numbers: 1, as there is a point, and its x and y on the table in meters.

    A point is a whole pixel, which is exact to 4 mm.
    """
    place = np.array([-0.05, 0.11, 0.02])
    subgoal = SubgoalTemplate("pick up the red cube {at}").at(points_of(place))

    found = encode_request(subgoal, OBJECTS)

    assert found[-3:] == pytest.approx([1, -0.05, 0.11], abs=0.004)


def test_a_subgoal_without_a_point_is_encoded_without_a_place():
    """The third number from the end says whether there is a point."""
    assert encode_request("pick up the red cube", OBJECTS)[-3] == 0


def test_words_that_are_no_subgoal_are_not_encoded():
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


@pytest.fixture
def recording_of_two_stages():
    """An episode, and a recording whose first two looks are of stage 0, the others of stage 1."""
    episode = get_episode("PickXtimes", "train", 0)
    return episode, recording_of(episode, [0, 0, 1, 1, 1])


def test_recordings_give_the_subgoal_of_the_stage_that_is_due(recording_of_two_stages):
    episode, recorded = recording_of_two_stages
    first, second, *_ = episode.stages

    due = subgoals_due(recorded, episode, range(5))

    words = [decision.move.words for decision in due]
    assert words == [first.subgoal] * 2 + [second.subgoal] * 3
    objects = [recorded.names[decision.object_number] for decision in due]
    assert objects == [first.points_at] * 2 + [second.points_at] * 3


def test_the_point_of_a_recorded_subgoal_is_that_at_its_start(recording_of_two_stages):
    """Objects move on at every look; a point is row and column in the picture."""
    episode, recorded = recording_of_two_stages
    number = recorded.names.index(episode.stages[1].points_at)
    column, row = points_of(recorded.things[2, number, :3].astype(float))

    found = recorded_subgoals(recorded, episode, [0, 0, 1, 1, 1], None)

    assert found[0] == found[1] != found[2] == found[3] == found[4]
    assert split_point(found[2])[1] == pytest.approx((row, column), abs=0.5)


def test_points_of_recorded_subgoals_are_moved_a_little_for_training(recording_of_two_stages):
    episode, recorded = recording_of_two_stages
    done = [0, 0, 1, 1, 1]

    exact = recorded_subgoals(recorded, episode, done, None)
    moved = recorded_subgoals(recorded, episode, done, np.random.default_rng(0))

    away = np.subtract(split_point(moved[2])[1], split_point(exact[2])[1])
    assert 0 < np.abs(away).max() <= MOST_POINT_NOISE + 1


@pytest.fixture
def history_of_three_changes():
    """Of three templates of subgoals, 0 is due at looks 2 and 4, 1 at look 7, 0 again at look 9."""
    history = PlannerHistory(3)
    for template, look in ((0, 2), (0, 4), (1, 7), (0, 9)):
        history.name(template, look)
    return history


def test_planner_history_keeps_the_looks_at_which_the_subgoal_changed(history_of_three_changes):
    assert history_of_three_changes.switches == [2, 7, 9]


def test_the_context_of_a_planner_is_what_was_done_what_is_under_way_and_since_when(
    history_of_three_changes,
):
    """At look 19: template 0 was done once, 1 once, 2 never; 0 is under way for 10 of 40 looks."""
    context = history_of_three_changes.context(19)

    assert context[:3].tolist() == [1, 1, 0]
    assert context[3:6].tolist() == [1, 0, 0]
    assert context[6:].tolist() == [0.25, 0, 0, 0]


def test_a_planner_sees_the_video_the_changes_and_the_current_look(history_of_three_changes):
    """The video has looks 0 and 1; what is left of the fixed number of frames is -1."""
    kept = history_of_three_changes.kept(video=2, look=19)

    assert [look for look in kept if look >= 0] == [0, 1, 2, 7, 9, 19]
    assert len(kept) == VIDEO_FRAMES + MAX_SWITCHES + 1


def test_a_planner_with_key_frames_is_not_told_what_it_named_before():
    """Else it could count by its own words, and key frames could not matter."""
    named = KeyframeHistory(3)
    for template, look in ((0, 2), (1, 7), (0, 9)):
        named.name(template, look)

    assert not len(named.context(19))
    assert named.kept(2, 19).tolist() == KeyframeHistory(3).kept(2, 19).tolist()


@pytest.mark.parametrize(
    ("chosen", "kept"),
    [
        ([[5, 6, 7], [20, 21], [23, 40]], [6, 21, 23, 40]),
        ([[5, 6, 7], [20, 21], [23, 40], [22]], [6, 22, 40]),
    ],
    ids=["neighbors", "one between two groups"],
)
def test_neighboring_key_frames_are_merged_into_their_middle_one(chosen, kept):
    """Looks 5, 6, 7 are neighbors: only the middle one, 6, is kept; 40 stands alone and is kept.

    Of an even group the later middle counts: 21 of 20 and 21, and 22 of 20 to 23, which are one
    group once 22 was chosen too. After these come the recent looks, which are not compared.
    """
    history = KeyframeHistory(3)
    for looks in chosen:
        history.choose(looks)

    found = history.kept(video=0, look=60)

    assert found[: len(kept)].tolist() == kept


def test_at_most_a_fixed_number_of_key_frames_is_kept():
    """50 looks, none next to another, are chosen after a video of 50 looks; not all are kept."""
    history = KeyframeHistory(3)
    history.choose(range(100, 200, 2))

    found = history.kept(video=50, look=300)

    assert (found >= 0).sum() == VIDEO_FRAMES + MAX_CHOSEN + RECENT


def test_a_planner_with_key_frames_sees_the_recent_looks_too():
    """Look 6 was chosen for good; now, at look 60, the recent looks follow it."""
    history = KeyframeHistory(3)
    history.choose([6])

    found = history.kept(video=0, look=60)

    assert found[: 1 + RECENT].tolist() == [6, *recent_looks(60)]


@pytest.fixture
def inputs_of_five_looks():
    """What a planner learns from looks 1, 4, 6, 9, 12, at which templates 0, 0, 1, 1, 0 are due."""
    templates = np.array([0, 0, 1, 1, 0])
    return ideal_planner_inputs(KeyframeHistory(2), templates, np.array([1, 4, 6, 9, 12]), 0)


def test_training_inputs_equal_those_of_a_planner_that_is_always_right(inputs_of_five_looks):
    """Before its third answer, at look 6, it has named template 0 at looks 1 and 4."""
    history = KeyframeHistory(2)
    history.name(0, 1)
    history.choose([1])
    history.name(0, 4)

    assert np.array_equal(inputs_of_five_looks.context[2], history.context(6))
    assert np.array_equal(inputs_of_five_looks.kept_looks[2], history.kept(0, 6))


def test_a_planner_learns_to_keep_the_looks_at_which_the_subgoal_changes(inputs_of_five_looks):
    """The last column is the current look; the first has none of the recent looks before it."""
    to_keep = inputs_of_five_looks.to_keep

    assert to_keep[:, -1].tolist() == [1, 0, 1, 0, 1]
    assert to_keep[0, :-2].tolist() == [-1] * (RECENT - 2)
    (kept_at_look_9,) = np.flatnonzero(to_keep[3] == 1)
    assert recent_looks(9)[kept_at_look_9] == 6


def test_a_look_at_which_no_subgoal_is_due_teaches_nothing():
    """A template of -1 is none: what comes after looks as if nothing had been asked."""
    looks = np.array([1, 2, 6])

    unasked = ideal_planner_inputs(KeyframeHistory(2), np.array([0, -1, 1]), looks, 0)

    assert (unasked.to_keep[1] == -1).all()
    history = KeyframeHistory(2)
    history.name(0, 1)
    assert np.array_equal(unasked.context[2], history.context(6))


@pytest.fixture(params=["subgoal", "keyframes"])
def saved_policy(request, tmp_path):
    """Return the files of a policy with a planner that has learned nothing."""
    pytest.importorskip("torch")
    from untrained import save_policy

    from roboirg_learn.policy.policy_files import PolicyFiles

    files = PolicyFiles(tmp_path / "a.body", tmp_path / "a.reader")
    save_policy(files, request.param, OBJECTS)
    return files


def observation_of(seed=0):
    picture = np.random.default_rng(seed).integers(0, 255, (256, 256, 3)).astype(np.uint8)
    tool = np.array([0.0, 0.0, 0.2, np.pi, 0.0, 0.0])
    return {
        "front_rgb": picture, "end_effector": tool, "gripper": np.array([0.04, 0.04]),
        "joint_positions": np.zeros(7), "history": (),
    }  # fmt: skip


NO_VIDEO = {"joint_positions": np.zeros((0, 7))}


@pytest.fixture
def learned_hands(saved_policy):
    """The saved policy at the beginning of an episode."""
    from roboirg_learn.kinds import make_learned

    hands = make_learned(saved_policy)
    hands.reset("pick the cube", NO_VIDEO)
    return hands


@pytest.mark.sim
def test_learned_hands_name_their_own_subgoal_if_none_is_given(learned_hands):
    action = learned_hands.act(observation_of())

    words, _ = split_point(learned_hands.subgoal)
    known = {
        SubgoalTemplate(template.words).at(None) for template in learned_hands.model.body.templates
    }
    assert words in known
    assert action.shape == (1, 7)


@pytest.mark.sim
def test_learned_hands_follow_a_given_subgoal_and_ignore_words_that_are_none(learned_hands):
    learned_hands.follow("press the button at <100, 90>")
    learned_hands.act(observation_of())
    learned_hands.follow("sing")

    assert learned_hands.subgoal == "press the button at <100, 90>"


@pytest.mark.sim
def test_learned_hands_that_were_given_nothing_but_nonsense_stand_still(learned_hands):
    """A waypoint is a pose, here that of the tool, and a command to the gripper."""
    learned_hands.follow("sing")

    (waypoint,) = learned_hands.act(observation_of())

    assert waypoint == pytest.approx([0.0, 0.0, 0.2, np.pi, 0.0, 0.0, 0.0])


@pytest.mark.sim
def test_a_new_episode_forgets_the_subgoal(learned_hands):
    learned_hands.follow("press the button at <100, 90>")

    learned_hands.reset("pick the cube", NO_VIDEO)

    assert learned_hands.subgoal is None


@pytest.mark.sim
@pytest.mark.parametrize(("options", "is_privileged"), [("", False), ("&hands=scripted", True)])
def test_a_learned_policy_is_hosted_unless_hands_read_the_simulator(
    saved_policy, options, is_privileged
):
    from roboirg.policies.by_name.finding import read_policy

    ref = read_policy(saved_policy.spec + options)

    assert ref.is_privileged == is_privileged
    assert ref.is_hosted != is_privileged


@pytest.mark.sim
def test_a_learned_planner_can_ask_scripted_hands(saved_policy):
    from roboirg.policies.by_name.finding import make_policy
    from roboirg_learn.policy.subgoal_following import LearnedPlanner

    policy = make_policy(f"{saved_policy.spec}&hands=scripted", seed=0)

    assert isinstance(policy.planner, LearnedPlanner)
    assert "front" in policy.cameras  # which the planner looks through; scripted hands need none


@pytest.mark.sim
@pytest.mark.parametrize(
    ("options", "actions"), [("", "waypoint"), ("%26actions=joint_angle", "joint_angle")]
)
def test_the_oracle_can_ask_learned_hands(saved_policy, options, actions):
    from roboirg.policies.by_name.finding import make_policy
    from roboirg_learn.policy.subgoal_following import LearnedHands

    policy = make_policy(f"planner:oracle?hands={saved_policy.spec}{options}", 0)

    assert isinstance(policy.policy, LearnedHands) == (actions == "waypoint")
    assert policy.actions == actions


@pytest.mark.sim
@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ("{own}&hands=scripted&actions=joint_angle", "other hands"),
        ("planner:stateless?model=none&hands={own}", "when-done"),
    ],
    ids=["joint angles of scripted hands", "a planner that waits for reports"],
)
def test_a_combination_that_cannot_act_is_refused(saved_policy, spec, reason):
    from roboirg.core.errors import InvalidValueError
    from roboirg.policies.by_name.finding import make_policy

    with pytest.raises(InvalidValueError, match=reason):
        make_policy(spec.format(own=saved_policy.spec), 0)
