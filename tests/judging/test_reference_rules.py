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


def sample(task, difficulty):
    """Scene and goal of the first seed that gives one."""
    return next(drawn_scenes(task.name, difficulty))


def make(task, difficulty="medium", goal=None):
    """An episode for the goal of its scene, or another."""
    scene, own = sample(task, difficulty)
    goal = goal or own
    stages = task.stages(scene, goal)
    shown = task.demonstration(scene)
    return Episode(task.name, "test", 0, 0, difficulty, scene, goal, stages, shown)


def judge_of(episode, *steps):
    return judged(episode.stages, episode.scene, *steps)


def verdict(episode, *steps):
    return judge_of(episode, *steps).status


# VideoRepick


def repick(repeats, difficulty="medium"):
    episode = make(VIDEO_REPICK, difficulty, Goal.of(repeats=repeats))
    target = episode.scene.past[0].subject
    return episode, Fact("picked", target), Fact("lying", target)


@pytest.mark.parametrize("repeats", [1, 2, 3])
def test_repick_as_often_as_wanted_then_press(repeats):
    episode, picked, lying = repick(repeats)
    cycle = [[lying], [picked], [], [lying]]

    assert verdict(episode, *cycle * repeats, [lying, PRESSED]) is Status.SUCCESS
    assert verdict(episode, *cycle * repeats) is Status.ONGOING


@pytest.mark.parametrize("done", [0, 1, 2, 3, 4])
def test_repick_of_any_other_cube_fails_at_any_time(done):
    episode, picked, lying = repick(2, "hard")
    start = [[picked], [lying], [picked], [lying]][:done]
    others = {cube.name for cube in episode.scene.of_kind("cube")} - {picked.subject}

    for other in others:
        judge = judge_of(episode, *start, [Fact("picked", other)])
        assert (judge.index, judge.status) == (done, Status.FAILURE)
        assert verdict(episode, *start, [Fact("lying", other)]) is Status.ONGOING


def test_repick_dropping_and_grasping_again_counts_as_what_it_is():
    episode, picked, lying = repick(1)
    # Held low or in the air, neither picked nor lying: nothing happens.
    assert verdict(episode, [picked], [], [], [picked], [lying], [PRESSED]) is Status.SUCCESS

    episode, picked, lying = repick(2)
    # Let go is put down, wherever that is: the next lift is the second one.
    steps = [[picked], [lying], [picked], [lying], [PRESSED]]
    assert verdict(episode, *steps) is Status.SUCCESS


WINDOW = [(0, False), (49, False), (50, True), (51, True), (500, True), (501, False), (900, False)]
PICK = "pick up the correct cube for the first time"
DOWN = "put it down"
AGAIN = "pick up the correct cube for the second time"


@pytest.mark.parametrize(("elapsed", "fails"), WINDOW)
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
def test_a_press_before_its_stage_is_over_fails_repick(steps, index, start, due, elapsed, fails):
    episode, picked, lying = repick(2)
    facts = {"": [], "picked": [picked], "lying": [lying]}
    judge = judge_of(episode, *(facts[step] for step in steps))

    judge.update(start + elapsed, frozenset([PRESSED]))

    assert judge.index == index
    if fails:
        assert (judge.status, judge.cause) == (Status.FAILURE, f"{TOO_EARLY}{due}")
    else:
        assert (judge.status, judge.cause) == (Status.ONGOING, None)


def test_repick_timers_do_not_start_with_the_video():
    episode, picked, lying = repick(1)
    judge = Judge((*episode.demonstration, *episode.stages), episode.scene)
    step = 0
    while judge.index < len(episode.demonstration):
        judge.update(step, frozenset([lying if step else picked, STILL, HOME]))
        step += 1

    assert step > 100
    for elapsed in (0, 49):
        judge.update(step + elapsed, frozenset([PRESSED]))
        assert judge.status is Status.ONGOING

    judge.update(step + 50, frozenset([PRESSED]))
    assert judge.status is Status.FAILURE


def test_repick_press_that_is_ignored_does_not_count():
    episode, picked, lying = repick(1)
    assert verdict(episode, [PRESSED], [picked], [lying]) is Status.ONGOING
    assert verdict(episode, [PRESSED], [picked], [lying], [PRESSED]) is Status.SUCCESS


# VideoPlaceButton and VideoPlaceOrder


PLACE_EPISODES = [
    make(task, "hard", goal)
    for task in (VIDEO_PLACE_BUTTON, VIDEO_PLACE_ORDER)
    for goal in task.goals(sample(task, "hard")[0])
]
"""Every goal of a scene with three cubes and four discs, in either task."""

every_place_goal = pytest.mark.parametrize(
    "episode",
    PLACE_EPISODES,
    ids=lambda episode: "-".join([episode.task, *(str(value) for _, value in episode.goal.slots)]),
)


def place_facts(episode):
    cube = f"cube_{episode.goal.text('color')}"
    visits = [fact.place for fact in episode.scene.past if fact.kind == "placed"]
    if episode.task == "VideoPlaceButton":
        answer = {"before": visits[0], "after": visits[1]}[episode.goal.text("relation")]
    else:
        answer = visits[episode.goal.number("placement") - 1]
    return Fact("picked", cube), Fact("placed", cube, answer)


@every_place_goal
def test_a_place_task_is_done_by_a_pick_and_the_right_place(episode):
    picked, placed = place_facts(episode)
    lying = Fact("lying", picked.subject)

    assert verdict(episode, [lying], [picked], [], [placed, lying]) is Status.SUCCESS
    assert verdict(episode, [placed]) is Status.ONGOING
    assert verdict(episode, [picked]) is Status.ONGOING


@every_place_goal
def test_place_on_any_other_disc_fails_even_together_with_the_right_one(episode):
    picked, placed = place_facts(episode)
    others = {disc.name for disc in episode.scene.of_kind("target")} - {placed.place}
    for other in others:
        wrong = Fact("placed", picked.subject, other)
        assert verdict(episode, [picked], [], [wrong]) is Status.FAILURE
        assert verdict(episode, [picked], [placed, wrong]) is Status.FAILURE
        # Before it is picked, the cube may be anywhere.
        assert verdict(episode, [wrong], [picked], [placed]) is Status.SUCCESS


@every_place_goal
def test_place_picking_another_cube_fails_until_the_right_one_is_picked(episode):
    picked, placed = place_facts(episode)
    others = {cube.name for cube in episode.scene.of_kind("cube")} - {picked.subject}
    for other in others:
        wrong = Fact("picked", other)
        assert verdict(episode, [wrong]) is Status.FAILURE
        assert verdict(episode, [wrong, picked]) is Status.FAILURE
        assert verdict(episode, [picked], [wrong], [placed]) is Status.SUCCESS
        elsewhere = Fact("placed", other, "target_3")
        assert verdict(episode, [elsewhere], [picked], [elsewhere, placed]) is Status.SUCCESS


@every_place_goal
def test_place_press_drop_and_site_do_not_matter(episode):
    picked, placed = place_facts(episode)
    lying = Fact("lying", picked.subject)
    site = Fact("placed", picked.subject, "site")
    steps = [[PRESSED, site, lying], [picked], [PRESSED], [lying], [lying, site], [picked]]

    assert verdict(episode, *steps) is Status.ONGOING
    assert verdict(episode, *steps, [placed, PRESSED]) is Status.SUCCESS
