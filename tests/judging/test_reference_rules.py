"""The rules of the three Reference tasks, driven by synthetic facts."""

import pytest
from drawn_scenes import drawn_scenes
from staged import judged

from roboirg.core.conditions import Fact
from roboirg.core.episode import Episode, Goal
from roboirg.judging import Judge, Status
from roboirg.tasks.video_place_button import TASK as VIDEO_PLACE_BUTTON
from roboirg.tasks.video_place_order import TASK as VIDEO_PLACE_ORDER
from roboirg.tasks.video_repick import TASK as VIDEO_REPICK

PRESSED = Fact("pressed", "button")
STILL = Fact("still", "robot")
HOME = Fact("home", "robot")


def episode_of(task, difficulty, goal):
    """Return an episode of a goal in the first scene that is drawn."""
    scene, _ = next(drawn_scenes(task.name, difficulty))
    stages = task.stages(scene, goal)
    shown = task.demonstration(scene)
    return Episode(task.name, "test", 0, 0, difficulty, scene, goal, stages, shown)


def judged_after(episode, *steps):
    return judged(episode.stages, episode.scene, *steps)


def status_after(episode, *steps):
    return judged_after(episode, *steps).status


# VideoRepick


def repick_episode_and_facts(repeats, difficulty="medium"):
    """Return an episode, and the facts that its cube is picked up, and that it lies."""
    episode = episode_of(VIDEO_REPICK, difficulty, Goal.of(repeats=repeats))
    target = episode.scene.past[0].subject
    return episode, Fact("picked", target), Fact("lying", target)


@pytest.mark.parametrize("repeats", [1, 2, 3])
def test_repick_succeeds_after_the_wanted_number_of_picks_and_a_press(repeats):
    """A cube is to be picked up and put down `repeats` times, and then the button pressed. Each
    list holds the facts of one step: the cube lies, is picked up, is in the air, lies again.
    Without the press the episode goes on."""
    episode, picked, lying = repick_episode_and_facts(repeats)
    picks = [[lying], [picked], [], [lying]] * repeats

    assert status_after(episode, *picks) is Status.ONGOING
    assert status_after(episode, *picks, [lying, PRESSED]) is Status.SUCCESS


@pytest.mark.parametrize("done", [0, 1, 2, 3, 4])
def test_repick_of_any_other_cube_fails_at_any_time(done):
    """The meant cube is picked up and put down, twice: four stages, of which the first `done` are
    complete. Then each other cube of the scene is picked up, which fails the stage that is due."""
    episode, picked, lying = repick_episode_and_facts(2, "hard")
    start = [[picked], [lying], [picked], [lying]][:done]
    for cube in episode.scene.of_kind("cube"):
        if cube.name != picked.subject:
            judge = judged_after(episode, *start, [Fact("picked", cube.name)])

            assert (judge.index, judge.status) == (done, Status.FAILURE), cube.name


def test_a_repick_goes_on_while_other_cubes_lie():
    """The meant cube was picked up and has to be put down. That another cube lies on the table, as
    it always did, neither completes nor fails this."""
    episode, picked, _ = repick_episode_and_facts(2, "hard")
    other = next(cube.name for cube in episode.scene.of_kind("cube") if cube.name != picked.subject)

    assert status_after(episode, [picked], [Fact("lying", other)]) is Status.ONGOING


def test_a_repick_goes_on_while_the_cube_is_in_the_air():
    """The cube is to be picked up once more, put down, and the button pressed. Each list holds the
    facts of one step. In the air, such as when it is held low, the cube is neither picked nor
    lying."""
    episode, picked, lying = repick_episode_and_facts(1)

    assert status_after(episode, [picked], [], [], [picked], [lying], [PRESSED]) is Status.SUCCESS


@pytest.mark.parametrize(
    ("facts", "timer_start", "due"),
    [
        ([""], 0, "pick up the correct cube for the first time"),
        ([*[""] * 40, "picked", ""], 41, "put it down"),
        (["picked", "lying"], 0, "pick up the correct cube for the second time"),
        (["picked", "lying", "picked"], 1, "put it down"),
    ],
    ids=["first pick", "first put down", "second pick", "second put down"],
)
def test_pressing_the_button_during_a_repick_stage_fails_from_50_to_500_steps(
    facts, timer_start, due
):
    """The cube is to be picked up and put down, twice, and then the button pressed. As in RoboMME,
    a press before that is forgiven until a timer is at 50 steps, and again after 500. One timer, of
    picking up, runs from step 0; another one, of putting down, from the step after the first pick;
    neither starts anew in the second round. `facts` has what is seen of the cube at each step
    before the press, and `due` is what has to be done then."""
    episode, picked, lying = repick_episode_and_facts(2)
    fact_sets = {"": [], "picked": [picked], "lying": [lying]}

    def judge_of_a_press(timer):
        judge = judged_after(episode, *(fact_sets[fact] for fact in facts))
        judge.update(timer_start + timer, frozenset([PRESSED]))
        return judge

    too_early = f"pressed the button too early; expected: {due}"
    assert judge_of_a_press(timer=49).status is Status.ONGOING
    assert judge_of_a_press(timer=50).cause == too_early
    assert judge_of_a_press(timer=500).cause == too_early
    assert judge_of_a_press(timer=501).status is Status.ONGOING


def judge_after_the_video(episode, picked, lying):
    """Return a judge at the first step of the policy's turn, and the number of this step.

    The video shows the cube picked up once; then the robot rests at home.
    """
    judge = Judge.of(episode)
    step = 0
    while judge.index < len(episode.demonstration):
        judge.update(step, frozenset([lying if step else picked, STILL, HOME]))
        step += 1
    judge.update(step, frozenset())
    return judge, step


@pytest.mark.parametrize(
    ("elapsed", "status"), [(1, Status.ONGOING), (49, Status.ONGOING), (50, Status.FAILURE)]
)
def test_the_time_in_which_a_press_is_ignored_starts_after_the_video(elapsed, status):
    """To press the button before the cube is picked up fails, but for the first 50 steps. They
    count from the policy's turn: the video has taken more than 50 steps already."""
    episode, picked, lying = repick_episode_and_facts(1)
    judge, policy_start = judge_after_the_video(episode, picked, lying)
    assert policy_start > 50

    judge.update(policy_start + elapsed, frozenset([PRESSED]))

    assert judge.status is status


def test_a_press_before_the_repick_does_not_replace_the_one_after_it():
    """The task is to pick a cube up once more and then to press the button. Each list holds the
    facts of one step. A press at the first step is too early to fail, but it does not count,
    either."""
    episode, picked, lying = repick_episode_and_facts(1)

    assert status_after(episode, [PRESSED], [picked], [lying]) is Status.ONGOING
    assert status_after(episode, [PRESSED], [picked], [lying], [PRESSED]) is Status.SUCCESS


# VideoPlaceButton and VideoPlaceOrder


def place_episode(task, **goal):
    """Return an episode with three cubes and four discs, and a goal for the green cube."""
    return episode_of(task, "hard", Goal.of(color="green", **goal))


every_place_goal = pytest.mark.parametrize(
    ("episode", "number"),
    [
        (place_episode(VIDEO_PLACE_BUTTON, relation="before"), 0),
        (place_episode(VIDEO_PLACE_BUTTON, relation="after"), 1),
        (place_episode(VIDEO_PLACE_ORDER, placement=1), 0),
        (place_episode(VIDEO_PLACE_ORDER, placement=2), 1),
    ],
    ids=["before the press", "after the press", "first", "second"],
)
"""`number` counts the placements of the video from 0: its disc is the right one."""

GREEN_PICKED = Fact("picked", "cube_green")
GREEN_LYING = Fact("lying", "cube_green")


def right_placement(episode, number):
    """Return the fact that the green cube is on the disc of a placement of the video."""
    shown = [fact.place for fact in episode.scene.past if fact.kind == "placed"]
    return Fact("placed", "cube_green", shown[number])


def wrong_placements(episode, number):
    """Return the facts that the green cube is on another disc."""
    right = right_placement(episode, number)
    found = []
    for disc in episode.scene.of_kind("target"):
        if disc.name != right.place:
            found.append(Fact("placed", "cube_green", disc.name))
    return found


@every_place_goal
def test_a_place_task_needs_the_right_cube_picked_and_then_placed_on_the_right_disc(
    episode, number
):
    """The goal is to put the green cube on the disc of placement `number` of the video; discs are
    targets on the table. Each list holds the facts of one step. Picked and then placed there it is
    a success; the pick or the placement alone leaves the episode undecided."""
    placed = right_placement(episode, number)

    assert status_after(episode, [GREEN_PICKED], [], [placed, GREEN_LYING]) is Status.SUCCESS
    assert status_after(episode, [placed]) is Status.ONGOING
    assert status_after(episode, [GREEN_PICKED]) is Status.ONGOING


@every_place_goal
def test_placing_the_right_cube_on_a_wrong_disc_fails(episode, number):
    """The goal is to put the green cube on the disc of placement `number` of the video, its
    `right_placement`. Every other disc fails, also if the cube is on the right one at the same
    time."""
    placed = right_placement(episode, number)
    for wrong in wrong_placements(episode, number):
        assert status_after(episode, [GREEN_PICKED], [], [wrong]) is Status.FAILURE, wrong
        assert status_after(episode, [GREEN_PICKED], [placed, wrong]) is Status.FAILURE, wrong


@every_place_goal
def test_before_it_is_picked_up_the_right_cube_may_be_on_any_disc(episode, number):
    """The goal is to put the green cube on the disc of placement `number` of the video. It first
    stands on another disc, as the video may have left it; then it is picked up and placed on the
    right one, which is a success."""
    placed = right_placement(episode, number)
    for wrong in wrong_placements(episode, number):
        assert status_after(episode, [wrong], [GREEN_PICKED], [placed]) is Status.SUCCESS, wrong


@every_place_goal
@pytest.mark.parametrize("other", ["cube_red", "cube_blue"])
def test_picking_another_cube_fails_unless_the_right_one_was_picked_before(episode, number, other):
    """The goal is to put the green cube on the disc of placement `number` of the video. A pick of
    another cube fails before that of the green one, and also together with it at the next step;
    once the green cube was picked, the next stage is to place it, which forbids no picks."""
    placed = right_placement(episode, number)
    wrong = Fact("picked", other)

    assert status_after(episode, [wrong]) is Status.FAILURE
    assert status_after(episode, [wrong, GREEN_PICKED]) is Status.FAILURE
    assert status_after(episode, [GREEN_PICKED], [wrong], [placed]) is Status.SUCCESS


@every_place_goal
def test_other_cubes_may_be_placed_anywhere(episode, number):
    """The goal is to put the green cube on the disc of placement `number` of the video. A red one
    stands on a disc all the time, which matters neither before the pick nor at the placement."""
    placed = right_placement(episode, number)
    other = Fact("placed", "cube_red", "target_3")

    assert status_after(episode, [other], [GREEN_PICKED], [other, placed]) is Status.SUCCESS


@every_place_goal
def test_in_a_place_task_presses_drops_and_the_marked_site_are_ignored(episode, number):
    """The green cube is to be put on a disc, the one of placement `number` of the video. Each list
    has the facts of a step: on the way, the button is pressed, and the cube lies on the site, a
    mark on the table that is no disc. Neither ends the episode; only the right disc does, also
    while the button is pressed."""
    picked = Fact("picked", "cube_green")
    pressed = Fact("pressed", "button")
    on_the_site = [Fact("lying", "cube_green"), Fact("placed", "cube_green", "site")]
    on_the_disc = right_placement(episode, number)
    way = [[pressed, *on_the_site], [picked], [pressed], on_the_site, [picked]]

    assert status_after(episode, *way) is Status.ONGOING
    assert status_after(episode, *way, [on_the_disc, pressed]) is Status.SUCCESS
