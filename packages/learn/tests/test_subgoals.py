"""Subgoals as numbers, what a planner keeps, and hands that follow any planner."""

import numpy as np
import pytest

from roboirg.core.subgoal_text import split_point
from roboirg.extension.sight import ExpertRecording, points_of
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.policy.planner_history import (
    MAX_CHOSEN,
    RECENT,
    VIDEO_FRAMES,
    KeyframeHistory,
    PlannerHistory,
    ideal_planner_inputs,
    recent_looks,
)
from roboirg_learn.policy.sight import ObjectClasses
from roboirg_learn.policy.subgoals import (
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
    """Learned hands read a subgoal as numbers; one of them is 1 for its motion, such as pick_cube.

    The subgoals are those of ten training episodes of the task, each pointing at a pixel. Their
    motions are those of the expert, but for two that the words do not tell from a simpler one:
    pressing below something is to press, and holding still until something happens is to hold.
    """
    in_words = {"press_below": "press", "hold_until": "hold"}

    for episode in range(10):
        for stage in get_episode(task, "train", episode).stages:
            subgoal = SubgoalTemplate(stage.subgoal).at(np.array([100.0, 90.0]))
            motion = stage.primitive.kind

            encoded = encode_request(subgoal, OBJECTS)

            assert encoded[REQUEST_WORDS.index(in_words.get(motion, motion))] == 1, subgoal


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
    """Return a recording in which every object moves a little at each look.

    Args:
        episode: which has the objects.
        done: how many stages are completed at each look.
    """
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


def test_recordings_give_the_subgoal_of_the_stage_that_is_due():
    """In the recording no stage is done at looks 0 and 1, the first one at looks 2 to 4.

    So the first subgoal is due at two looks, the second at three. The episode's first subgoals are
    to pick the red cube up and to place it onto the target.
    """
    episode = get_episode("PickXtimes", "train", 0)
    recorded = recording_of(episode, done=[0, 0, 1, 1, 1])

    due = subgoals_due(recorded, episode, range(5))

    pick = "pick up the red cube {at} for the first time"
    place = "place the red cube onto the target {at}"
    assert [decision.move.words for decision in due] == [pick] * 2 + [place] * 3
    objects = [recorded.names[decision.object_number] for decision in due]
    assert objects == ["cube_red"] * 2 + ["target"] * 3


def test_a_recorded_subgoal_points_at_its_object_where_that_was_when_the_stage_began():
    """In the recording all objects move at every look; the first stage is done from look 2 on.

    So at looks 2 to 4 the second subgoal points at the target, where it was at look 2. A point is
    a pixel, row and column, rounded.
    """
    episode = get_episode("PickXtimes", "train", 0)
    recorded = recording_of(episode, done=[0, 0, 1, 1, 1])
    target = recorded.things[2, recorded.names.index("target"), :3]
    column, row = points_of(target.astype(float))

    found = recorded_subgoals(recorded, episode, stages_done=[0, 0, 1, 1, 1], rng=None)

    assert found[2:] == [f"place the red cube onto the target at <{row:.0f}, {column:.0f}>"] * 3
    assert found[0] == found[1] != found[2]


def test_the_point_of_a_recorded_subgoal_is_moved_by_some_pixels_for_training():
    """Learned planners err, too. A point is moved by at most 8 pixels, here to another pixel.

    As both points are rounded to whole pixels, they may be 9 apart.
    """
    episode = get_episode("PickXtimes", "train", 0)
    recorded = recording_of(episode, done=[0])

    (exact,) = recorded_subgoals(recorded, episode, stages_done=[0], rng=None)
    (moved,) = recorded_subgoals(recorded, episode, stages_done=[0], rng=np.random.default_rng(0))

    _, point = split_point(exact)
    _, moved_point = split_point(moved)
    assert 0 < np.abs(np.subtract(moved_point, point)).max() <= 8 + 1


def named_in(history, template_at_look):
    """Return a history in which a planner has named subgoals, as in ``{2: 0, 7: 1}``.

    A look is a picture that it saw, by number; a template is a subgoal without its point.
    """
    for look, template in template_at_look.items():
        history.name(template, look)
    return history


def test_planner_history_keeps_the_looks_at_which_the_subgoal_changed():
    """Subgoal 0 is named at looks 2 and 4, which is no change, 1 at look 7, and 0 again at 9."""
    history = named_in(PlannerHistory(templates=3), {2: 0, 4: 0, 7: 1, 9: 0})

    assert history.switches == [2, 7, 9]


def test_the_context_of_a_planner_is_what_was_done_what_is_under_way_and_since_when():
    """Of three subgoals, 0 was named at looks 2 to 6, 1 at 7 and 8, and 0 again since look 9.

    At look 19 subgoals 0 and 1 were done once each, and 0 is under way for 10 looks, a quarter of
    the 40 that are counted at most. Three zeros follow, where hands have a point.
    """
    history = named_in(PlannerHistory(templates=3), {2: 0, 7: 1, 9: 0})

    times_done, under_way, since_and_point = np.split(history.context(look=19), [3, 6])

    assert times_done.tolist() == [1, 1, 0]
    assert under_way.tolist() == [1, 0, 0]
    assert since_and_point.tolist() == [10 / 40, 0, 0, 0]


def test_a_planner_sees_the_video_the_changes_and_the_current_look():
    """The video is looks 0 and 1, the subgoal changed at looks 2, 7 and 9, and now is look 19.

    There is room for 10 looks of the video, 4 changes and the current look; what is left is -1.
    """
    history = named_in(PlannerHistory(templates=3), {2: 0, 7: 1, 9: 0})

    kept = history.kept(video=2, look=19)

    assert kept.tolist() == [0, 1, 2, 7, 9, 19] + [-1] * 9


def test_a_planner_with_key_frames_is_not_told_what_it_named_before():
    """Else it could count by its own words, and the frames that it chose could not matter.

    It has named subgoals at looks 2, 7 and 9. At look 19 its history has no numbers about them, and
    keeps the same looks as that of a planner that has named nothing.
    """
    history = named_in(KeyframeHistory(templates=3), {2: 0, 7: 1, 9: 0})

    unnamed = KeyframeHistory(templates=3)
    assert len(history.context(look=19)) == 0
    assert history.kept(2, look=19).tolist() == unnamed.kept(2, look=19).tolist()


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


def inputs_of_perfect_planner(history, template_at_look):
    """Return what a planner learns from if it named the right subgoals, as in ``{2: 0, 7: 1}``.

    A look is a picture that it saw, by number; a template is a subgoal without its point, or -1
    where none is due. There is no video.
    """
    templates = np.array(list(template_at_look.values()))
    return ideal_planner_inputs(history, templates, np.array(list(template_at_look)), video=0)


def test_training_inputs_equal_those_of_a_planner_that_is_always_right():
    """At looks 1 and 4 subgoal 0 is due, at look 6 subgoal 1.

    So before it answers at look 6, a planner that is right has named 0 twice, and has kept look 1,
    where the subgoal changed.
    """
    inputs = inputs_of_perfect_planner(KeyframeHistory(templates=2), {1: 0, 4: 0, 6: 1})

    history = named_in(KeyframeHistory(templates=2), {1: 0, 4: 0})
    history.choose([1])
    assert inputs.context[2].tolist() == history.context(look=6).tolist()
    assert inputs.kept_looks[2].tolist() == history.kept(0, look=6).tolist()


def test_a_planner_learns_to_keep_the_looks_at_which_the_subgoal_changes():
    """Subgoal 0 is due at look 1, and subgoal 1 at looks 6 and 9: it changes at looks 1 and 6.

    At each look there is a label for each of the 8 latest looks, the current one last: 1 to keep
    it, 0 not to, -1 if there is none.
    """
    inputs = inputs_of_perfect_planner(KeyframeHistory(templates=2), {1: 0, 6: 1, 9: 1})

    assert inputs.to_keep.tolist() == [
        [-1, -1, -1, -1, -1, -1, 0, 1],  # up to look 1
        [-1, 0, 1, 0, 0, 0, 0, 1],  # looks -1 to 6
        [0, 0, 0, 0, 1, 0, 0, 0],  # looks 2 to 9
    ]


def test_a_look_at_which_no_subgoal_is_due_teaches_nothing():
    """At looks 1 and 6 subgoals are due, at look 2 none (-1).

    So nothing is learned at look 2 about which of the 8 latest looks to keep, and what the planner
    has named before look 6 is subgoal 0 at look 1.
    """
    inputs = inputs_of_perfect_planner(PlannerHistory(templates=2), {1: 0, 2: -1, 6: 1})

    history = named_in(PlannerHistory(templates=2), {1: 0})
    assert inputs.to_keep[1].tolist() == [-1] * 8
    assert inputs.context[2].tolist() == history.context(look=6).tolist()


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
    """The fixture's policy has learned nothing, but knows the subgoals of a task as templates.

    A template is a subgoal without its point, such as "press the button {at} to stop". Without a
    planner the policy names one of these itself, and acts: a waypoint of seven numbers.
    """
    action = learned_hands.act(observation_of())

    words, _ = split_point(learned_hands.subgoal)
    known = [template.at(None) for template in learned_hands.model.body.templates]
    assert words in known
    assert action.shape == (1, 7)


@pytest.mark.sim
def test_learned_hands_follow_a_given_subgoal_and_ignore_words_that_are_none(learned_hands):
    """ "sing" is no subgoal that can be carried out, so the one before stays."""
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
    """A subgoal of the last episode would point to where nothing stands any more."""
    learned_hands.follow("press the button at <100, 90>")

    learned_hands.reset("pick the cube", NO_VIDEO)

    assert learned_hands.subgoal is None


@pytest.mark.sim
@pytest.mark.parametrize(("options", "is_privileged"), [("", False), ("&hands=scripted", True)])
def test_a_learned_policy_is_hosted_unless_hands_read_the_simulator(
    saved_policy, options, is_privileged
):
    """A hosted policy has a process of its own, out of which scripted hands could not read."""
    from roboirg.policies.by_name.finding import read_policy

    ref = read_policy(saved_policy.spec + options)

    assert ref.is_privileged == is_privileged
    assert ref.is_hosted != is_privileged


@pytest.mark.sim
def test_a_learned_planner_can_ask_scripted_hands(saved_policy):
    """The planner looks through the front camera; scripted hands need no picture."""
    from roboirg.policies.by_name.finding import make_policy
    from roboirg_learn.policy.subgoal_following import LearnedPlanner

    policy = make_policy(f"{saved_policy.spec}&hands=scripted", seed=0)

    assert isinstance(policy.planner, LearnedPlanner)
    assert "front" in policy.cameras  # which the planner looks through; scripted hands need none


@pytest.mark.sim
@pytest.mark.parametrize(
    ("options", "kind", "actions"),
    [
        ("", "LearnedHands", "waypoint"),
        ("%26actions=joint_angle", "JointChunksOfHands", "joint_angle"),
    ],
)
def test_the_oracle_can_ask_learned_hands(saved_policy, options, kind, actions):
    """The oracle names the right subgoals, and the saved policy, as its hands, carries them out.

    It acts in waypoints. With the option actions=joint_angle (%26 is an escaped &) it is wrapped in
    `JointChunksOfHands`, which turns waypoints into joint angles.
    """
    from roboirg.policies.by_name.finding import make_policy

    policy = make_policy(f"planner:oracle?hands={saved_policy.spec}{options}", 0)

    assert type(policy.policy).__name__ == kind
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
    """Scripted hands act in one way only, and learned hands never report that a subgoal is done."""
    from roboirg.core.errors import InvalidValueError
    from roboirg.policies.by_name.finding import make_policy

    with pytest.raises(InvalidValueError, match=reason):
        make_policy(spec.format(own=saved_policy.spec), 0)
