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
TOO_EARLY = "pressed the button too early; expected: "


def scene_and_goal(task, difficulty):
    """Scene and goal of the first seed that gives one."""
    return next(drawn_scenes(task.name, difficulty))


def episode_of(task, difficulty="medium", goal=None):
    """An episode for the goal of its scene, or another."""
    scene, own = scene_and_goal(task, difficulty)
    goal = goal or own
    stages = task.stages(scene, goal)
    shown = task.demonstration(scene)
    return Episode(task.name, "test", 0, 0, difficulty, scene, goal, stages, shown)


def judged_after(episode, *steps):
    return judged(episode.stages, episode.scene, *steps)


def status_after(episode, *steps):
    return judged_after(episode, *steps).status


# VideoRepick


def repick_episode_and_facts(repeats, difficulty="medium"):
    episode = episode_of(VIDEO_REPICK, difficulty, Goal.of(repeats=repeats))
    target = episode.scene.past[0].subject
    return episode, Fact("picked", target), Fact("lying", target)


@pytest.mark.parametrize("repeats", [1, 2, 3])
def test_repick_succeeds_after_the_wanted_number_of_picks_and_a_press(repeats):
    """Each list holds the facts of one step: the cube
    lies, is picked up, is in the air, lies again."""
    episode, picked, lying = repick_episode_and_facts(repeats)
    cycle = [[lying], [picked], [], [lying]]

    assert status_after(episode, *cycle * repeats, [lying, PRESSED]) is Status.SUCCESS
    assert status_after(episode, *cycle * repeats) is Status.ONGOING


@pytest.mark.parametrize("done", [0, 1, 2, 3, 4])
def test_repick_of_any_other_cube_fails_at_any_time(done):
    """`done` is how many of the four stages (pick and put down, twice) are complete before."""
    episode, picked, lying = repick_episode_and_facts(2, "hard")
    start = [[picked], [lying], [picked], [lying]][:done]
    others = {cube.name for cube in episode.scene.of_kind("cube")} - {picked.subject}

    for other in others:
        judge = judged_after(episode, *start, [Fact("picked", other)])
        assert (judge.index, judge.status) == (done, Status.FAILURE)
        assert status_after(episode, *start, [Fact("lying", other)]) is Status.ONGOING


def test_repick_counts_a_cube_that_was_let_go_as_put_down():
    """Each list holds the facts of one step. In the
    air, neither picked nor lying, nothing happens."""
    episode, picked, lying = repick_episode_and_facts(1)
    # Held low or in the air, neither picked nor lying: nothing happens.
    assert status_after(episode, [picked], [], [], [picked], [lying], [PRESSED]) is Status.SUCCESS

    episode, picked, lying = repick_episode_and_facts(2)
    # Let go is put down, wherever that is: the next lift is the second one.
    steps = [[picked], [lying], [picked], [lying], [PRESSED]]
    assert status_after(episode, *steps) is Status.SUCCESS


PRESS_TIMES = [
    (0, False),
    (49, False),
    (50, True),
    (51, True),
    (500, True),
    (501, False),
    (900, False),
]
PICK = "pick up the correct cube for the first time"
DOWN = "put it down"
AGAIN = "pick up the correct cube for the second time"


@pytest.mark.parametrize(("elapsed", "fails"), PRESS_TIMES)
@pytest.mark.parametrize(
    ("steps", "index", "start", "due"),
    [
        ([""], 0, 0, PICK),
        # The timer of putting down starts at the evaluation after the one that completes the pick.
        ([*[""] * 40, "picked", ""], 1, 41, DOWN),
        # Timers run on over the repetitions; that of putting down started one step later.
        (["picked", "lying"], 2, 0, AGAIN),
        (["picked", "lying", "picked"], 3, 1, DOWN),
    ],
)
def test_pressing_the_button_during_a_repick_stage_fails_from_50_to_500_steps(
    steps, index, start, due, elapsed, fails
):
    """A press is punished 50 to 500 steps after the timer of the current stage has started;
    `start` is the step of that, `index` the stage, and `due` what the cause names as expected."""
    episode, picked, lying = repick_episode_and_facts(2)
    facts = {"": [], "picked": [picked], "lying": [lying]}
    judge = judged_after(episode, *(facts[step] for step in steps))

    judge.update(start + elapsed, frozenset([PRESSED]))

    assert judge.index == index
    if fails:
        assert (judge.status, judge.cause) == (Status.FAILURE, f"{TOO_EARLY}{due}")
    else:
        assert (judge.status, judge.cause) == (Status.ONGOING, None)


def test_the_time_in_which_a_press_is_ignored_starts_after_the_video():
    """A press is ignored for the first 50 steps of the policy's turn; the video is longer."""
    episode, picked, lying = repick_episode_and_facts(1)
    judge = Judge((*episode.demonstration, *episode.stages), episode.scene)
    step = 0
    while judge.index < len(episode.demonstration):
        judge.update(step, frozenset([lying if step else picked, STILL, HOME]))
        step += 1

    assert step > 100  # the video alone is longer than the 50 steps
    for elapsed in (0, 49):
        judge.update(step + elapsed, frozenset([PRESSED]))
        assert judge.status is Status.ONGOING

    judge.update(step + 50, frozenset([PRESSED]))
    assert judge.status is Status.FAILURE


def test_a_press_before_the_repick_does_not_replace_the_one_after_it():
    """The task is to pick a cube up once more and to
    press the button; early presses are ignored."""
    episode, picked, lying = repick_episode_and_facts(1)
    assert status_after(episode, [PRESSED], [picked], [lying]) is Status.ONGOING
    assert status_after(episode, [PRESSED], [picked], [lying], [PRESSED]) is Status.SUCCESS


# VideoPlaceButton and VideoPlaceOrder


PLACE_EPISODES = [
    episode_of(task, "hard", goal)
    for task in (VIDEO_PLACE_BUTTON, VIDEO_PLACE_ORDER)
    for goal in task.goals(scene_and_goal(task, "hard")[0])
]
"""Every goal of a scene with three cubes and four discs, in either task."""

every_place_goal = pytest.mark.parametrize(
    "episode",
    PLACE_EPISODES,
    ids=lambda episode: "-".join([episode.task, *(str(value) for _, value in episode.goal.slots)]),
)


def right_pick_and_right_place(episode):
    cube = f"cube_{episode.goal.text('color')}"
    visits = [fact.place for fact in episode.scene.past if fact.kind == "placed"]
    if episode.task == "VideoPlaceButton":
        answer = {"before": visits[0], "after": visits[1]}[episode.goal.text("relation")]
    else:
        answer = visits[episode.goal.number("placement") - 1]
    return Fact("picked", cube), Fact("placed", cube, answer)


@every_place_goal
def test_a_place_task_needs_the_right_cube_picked_and_then_placed_on_the_right_disc(episode):
    """Each list holds the facts of one step; discs are targets on the table."""
    picked, placed = right_pick_and_right_place(episode)
    lying = Fact("lying", picked.subject)

    assert status_after(episode, [lying], [picked], [], [placed, lying]) is Status.SUCCESS
    assert status_after(episode, [placed]) is Status.ONGOING
    assert status_after(episode, [picked]) is Status.ONGOING


@every_place_goal
def test_placing_the_right_cube_on_a_wrong_disc_fails(episode):
    """Discs are targets on the table. Before it is picked up, the cube may be on any."""
    picked, placed = right_pick_and_right_place(episode)
    others = {disc.name for disc in episode.scene.of_kind("target")} - {placed.place}
    for other in others:
        wrong = Fact("placed", picked.subject, other)
        assert status_after(episode, [picked], [], [wrong]) is Status.FAILURE
        assert status_after(episode, [picked], [placed, wrong]) is Status.FAILURE
        # Before it is picked, the cube may be anywhere.
        assert status_after(episode, [wrong], [picked], [placed]) is Status.SUCCESS


@every_place_goal
def test_picking_another_cube_fails_unless_the_right_one_was_picked_before(episode):
    """Each list holds the facts of one step."""
    picked, placed = right_pick_and_right_place(episode)
    others = {cube.name for cube in episode.scene.of_kind("cube")} - {picked.subject}
    for other in others:
        wrong = Fact("picked", other)
        assert status_after(episode, [wrong]) is Status.FAILURE
        assert status_after(episode, [wrong, picked]) is Status.FAILURE
        assert status_after(episode, [picked], [wrong], [placed]) is Status.SUCCESS
        elsewhere = Fact("placed", other, "target_3")
        assert status_after(episode, [elsewhere], [picked], [elsewhere, placed]) is Status.SUCCESS


@every_place_goal
def test_in_a_place_task_presses_drops_and_the_marked_site_are_ignored(episode):
    """The site is a mark on the table that is no target."""
    picked, placed = right_pick_and_right_place(episode)
    lying = Fact("lying", picked.subject)
    site = Fact("placed", picked.subject, "site")
    steps = [[PRESSED, site, lying], [picked], [PRESSED], [lying], [lying, site], [picked]]

    assert status_after(episode, *steps) is Status.ONGOING
    assert status_after(episode, *steps, [placed, PRESSED]) is Status.SUCCESS
