"""The rules of the four Unmask tasks, driven by synthetic facts."""

import pytest
from staged import judged

from roboirg.core.conditions import Fact
from roboirg.judging import Status
from roboirg.tasks.splits.splits import make_episode

BUTTON, LEFT, RIGHT = (Fact("pressed", name) for name in ("button", "button_left", "button_right"))
PRESSES_OF = {
    "VideoUnmask": [],
    "VideoUnmaskSwap": [],
    "ButtonUnmask": [[BUTTON], []],
    "ButtonUnmaskSwap": [[LEFT], [], [RIGHT], []],
}
each_task = pytest.mark.parametrize("task", PRESSES_OF)
each_button_task = pytest.mark.parametrize("task", ["ButtonUnmask", "ButtonUnmaskSwap"])


@pytest.fixture(params=[3, 11, 25])
def seed(request):
    return request.param


def lifted(name):
    return Fact("lifted", name)


def put_down(name):
    return Fact("put_down", name)


def presses_alone(task):
    """Return the presses of a task without the moments between them."""
    return [press for press in PRESSES_OF[task] if press]


def judged_after(episode, *steps):
    return judged(episode.stages, episode.scene, *steps)


def containers_to_lift_and_others(episode):
    """The containers over the named cubes, in order, and all other containers."""
    wanted = [str(episode.scene[f"cube_{color}"].inside) for color in episode.goal.texts("colors")]
    names = [item.name for item in episode.scene.of_kind("container")]
    return wanted, [name for name in names if name not in wanted]


def episode_with_two_picks(task, seed):
    """An episode with two picks, its two targets and the other containers."""
    episode = make_episode(task, seed, "hard")
    (first, second), others = containers_to_lift_and_others(episode)
    return episode, first, second, others


@each_task
def test_one_pick_succeeds_when_the_container_over_the_cube_is_lifted(task, seed):
    """Each list holds the facts of one step; `PRESSES_OF`
    has the buttons that a task begins with."""
    episode = make_episode(task, seed, "medium")
    (target,), _ = containers_to_lift_and_others(episode)

    judge = judged_after(episode, *PRESSES_OF[task], [], [lifted(target)])

    assert judge.status is Status.SUCCESS
    assert judge.cause is None


@each_task
def test_two_picks_succeed_in_order_with_the_first_put_down_between(task, seed):
    """Each list holds the facts of one step; `PRESSES_OF`
    has the buttons that a task begins with."""
    episode, first, second, _ = episode_with_two_picks(task, seed)
    begin = [*PRESSES_OF[task], [lifted(first)], [], [put_down(first)], []]

    assert judged_after(episode, *begin).status is Status.ONGOING
    assert judged_after(episode, *begin, [lifted(second)]).status is Status.SUCCESS


@each_task
def test_lifting_another_container_before_the_first_is_put_down_fails(task, seed):
    """The goal has two containers, `first` and `second`;
    after lifting one it has to be put down."""
    episode, first, second, others = episode_with_two_picks(task, seed)

    for wrong in (second, *others):
        steps = [[lifted(first)], [put_down(first), lifted(wrong)]]
        judge = judged_after(episode, *PRESSES_OF[task], *steps)
        assert judge.status is Status.FAILURE
        assert str(judge.cause).endswith("; expected: put down the container")


@each_task
def test_lifting_a_wrong_container_as_the_second_one_fails(task, seed):
    """The first one again is wrong, too."""
    episode, first, _, others = episode_with_two_picks(task, seed)

    for wrong in (first, *others):
        steps = [[lifted(first)], [put_down(first)], [lifted(wrong)]]
        assert judged_after(episode, *PRESSES_OF[task], *steps).status is Status.FAILURE


@each_task
def test_holding_the_first_container_long_or_lifting_it_again_is_allowed(task, seed):
    """The goal has two containers, and the first one is put down late."""
    episode, first, second, _ = episode_with_two_picks(task, seed)
    held = [[lifted(first)]] * 5
    steps = [*PRESSES_OF[task], *held, [], [lifted(first)], []]
    assert judged_after(episode, *steps).status is Status.ONGOING

    steps += [[put_down(first)], [lifted(second)]]
    assert judged_after(episode, *steps).status is Status.SUCCESS


@each_task
def test_putting_down_other_containers_does_not_complete_putting_down_the_first(task, seed):
    """The stage before the last one stays due."""
    episode, first, second, others = episode_with_two_picks(task, seed)
    down = [put_down(name) for name in (second, *others)]

    judge = judged_after(episode, *PRESSES_OF[task], [lifted(first)], down)

    assert (judge.status, judge.index) == (Status.ONGOING, len(episode.stages) - 2)


@each_button_task
def test_before_the_button_is_pressed_any_container_may_be_lifted(task, seed):
    """Buttons come first in these tasks; what is done before them is ignored."""
    episode, first, second, others = episode_with_two_picks(task, seed)
    everything = [lifted(name) for name in (first, second, *others)]
    steps = [[fact] for fact in everything]
    for press in presses_alone(task):
        steps += [everything, press]

    judge = judged_after(episode, *steps, [lifted(first)], [put_down(first)])
    assert judge.status is Status.ONGOING

    judge.update(100, frozenset([lifted(second)]))
    assert judge.status is Status.SUCCESS


@each_button_task
def test_a_container_that_is_up_during_the_last_press_counts_one_step_later(task, seed):
    """The goal has one container: if it is up it succeeds, if another one is up it fails."""
    episode = make_episode(task, seed, "medium")
    (target,), others = containers_to_lift_and_others(episode)
    *before, last = presses_alone(task)
    for up, outcome in ((target, Status.SUCCESS), (others[0], Status.FAILURE)):
        judge = judged_after(episode, *before, [*last, lifted(up)])
        assert judge.status is Status.ONGOING

        judge.update(100, frozenset([lifted(up)]))
        assert judge.status is outcome


@each_button_task
def test_pressing_again_later_has_no_effect(task, seed):
    """The goal has two containers; the buttons are pressed again at each moment."""
    episode, first, second, _ = episode_with_two_picks(task, seed)
    again = presses_alone(task)
    steps = [*PRESSES_OF[task], *again, [lifted(first)], *again, [put_down(first)], *again]

    assert judged_after(episode, *steps).status is Status.ONGOING
    assert judged_after(episode, *steps, [lifted(second)]).status is Status.SUCCESS


@pytest.mark.parametrize("order", [(LEFT, RIGHT), (RIGHT, LEFT)])
@pytest.mark.parametrize("between", [[], [[]]])
def test_both_buttons_may_be_pressed_in_any_order(order, between):
    """Index 1 or 2 is how many stages are complete; `between` is a step without facts, or none."""
    episode = make_episode("ButtonUnmaskSwap", 3, "medium")
    first, other = order

    assert judged_after(episode, [first]).index == 1
    assert judged_after(episode, [first], *between, [other]).index == 2
    # Already the other one while the first is still down.
    assert judged_after(episode, [first], [first, other]).index == 2


@pytest.mark.parametrize("button", [LEFT, RIGHT])
def test_pressing_the_same_button_twice_completes_only_one_of_two_presses(button):
    """The task begins with a press of each of two
    buttons; index 1 means that one stage is complete."""
    episode = make_episode("ButtonUnmaskSwap", 3, "medium")
    assert judged_after(episode, [button], [], [button], [], [button]).index == 1
    assert judged_after(episode, *[[button]] * 10).index == 1
