"""The rules of the four Unmask tasks, driven by synthetic facts."""

import pytest
from staged import judged

from roboirg.core.conditions import Fact
from roboirg.judging import Status
from roboirg.tasks.splits.splits import make_episode

BUTTON, LEFT, RIGHT = (Fact("pressed", name) for name in ("button", "button_left", "button_right"))
PRESSES = {
    "VideoUnmask": [],
    "VideoUnmaskSwap": [],
    "ButtonUnmask": [[BUTTON], []],
    "ButtonUnmaskSwap": [[LEFT], [], [RIGHT], []],
}
each_task = pytest.mark.parametrize("task", PRESSES)
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
    return [press for press in PRESSES[task] if press]


def verdict(episode, *steps):
    return judged(episode.stages, episode.scene, *steps)


def named(episode):
    """The containers over the named cubes, in order, and all other containers."""
    wanted = [str(episode.scene[f"cube_{color}"].inside) for color in episode.goal.texts("colors")]
    names = [item.name for item in episode.scene.of_kind("container")]
    return wanted, [name for name in names if name not in wanted]


def hard(task, seed):
    """An episode with two picks, its two targets and the other containers."""
    episode = make_episode(task, seed, "hard")
    (first, second), others = named(episode)
    return episode, first, second, others


@each_task
def test_one_pick_succeeds_when_the_container_over_the_cube_is_lifted(task, seed):
    episode = make_episode(task, seed, "medium")
    (target,), _ = named(episode)

    judge = verdict(episode, *PRESSES[task], [], [lifted(target)])

    assert judge.status is Status.SUCCESS
    assert judge.cause is None


@each_task
def test_two_picks_succeed_in_order_with_the_first_put_down_between(task, seed):
    episode, first, second, _ = hard(task, seed)
    begin = [*PRESSES[task], [lifted(first)], [], [put_down(first)], []]

    assert verdict(episode, *begin).status is Status.ONGOING
    assert verdict(episode, *begin, [lifted(second)]).status is Status.SUCCESS


@each_task
def test_any_other_container_fails_the_putting_down(task, seed):
    episode, first, second, others = hard(task, seed)

    for wrong in (second, *others):
        steps = [[lifted(first)], [put_down(first), lifted(wrong)]]
        judge = verdict(episode, *PRESSES[task], *steps)
        assert judge.status is Status.FAILURE
        assert str(judge.cause).endswith("; expected: put down the container")


@each_task
def test_any_other_container_fails_the_second_pick(task, seed):
    episode, first, _, others = hard(task, seed)

    for wrong in (first, *others):
        steps = [[lifted(first)], [put_down(first)], [lifted(wrong)]]
        assert verdict(episode, *PRESSES[task], *steps).status is Status.FAILURE


@each_task
def test_the_container_that_is_held_or_lifted_again_before_it_is_down_is_fine(task, seed):
    episode, first, second, _ = hard(task, seed)
    held = [[lifted(first)]] * 5
    steps = [*PRESSES[task], *held, [], [lifted(first)], []]
    assert verdict(episode, *steps).status is Status.ONGOING

    steps += [[put_down(first)], [lifted(second)]]
    assert verdict(episode, *steps).status is Status.SUCCESS


@each_task
def test_the_first_container_has_to_be_put_down_and_no_other_will_do(task, seed):
    episode, first, second, others = hard(task, seed)
    down = [put_down(name) for name in (second, *others)]

    judge = verdict(episode, *PRESSES[task], [lifted(first)], down)

    assert (judge.status, judge.index) == (Status.ONGOING, len(episode.stages) - 2)


@each_button_task
def test_nothing_fails_while_a_button_is_due(task, seed):
    episode, first, second, others = hard(task, seed)
    everything = [lifted(name) for name in (first, second, *others)]
    steps = [[fact] for fact in everything]
    for press in presses_alone(task):
        steps += [everything, press]

    judge = verdict(episode, *steps, [lifted(first)], [put_down(first)])
    assert judge.status is Status.ONGOING

    judge.update(100, frozenset([lifted(second)]))
    assert judge.status is Status.SUCCESS


@each_button_task
def test_what_is_up_after_the_last_press_counts_one_step_later(task, seed):
    episode = make_episode(task, seed, "medium")
    (target,), others = named(episode)
    *before, last = presses_alone(task)
    for up, outcome in ((target, Status.SUCCESS), (others[0], Status.FAILURE)):
        judge = verdict(episode, *before, [*last, lifted(up)])
        assert judge.status is Status.ONGOING

        judge.update(100, frozenset([lifted(up)]))
        assert judge.status is outcome


@each_button_task
def test_pressing_again_later_has_no_effect(task, seed):
    episode, first, second, _ = hard(task, seed)
    again = presses_alone(task)
    steps = [*PRESSES[task], *again, [lifted(first)], *again, [put_down(first)], *again]

    assert verdict(episode, *steps).status is Status.ONGOING
    assert verdict(episode, *steps, [lifted(second)]).status is Status.SUCCESS


@pytest.mark.parametrize("order", [(LEFT, RIGHT), (RIGHT, LEFT)])
@pytest.mark.parametrize("between", [[], [[]]])
def test_both_buttons_may_be_pressed_in_any_order(order, between):
    episode = make_episode("ButtonUnmaskSwap", 3, "medium")
    first, other = order

    assert verdict(episode, [first]).index == 1
    assert verdict(episode, [first], *between, [other]).index == 2
    # Already the other one while the first is still down.
    assert verdict(episode, [first], [first, other]).index == 2


@pytest.mark.parametrize("button", [LEFT, RIGHT])
def test_one_button_twice_or_held_is_not_both(button):
    episode = make_episode("ButtonUnmaskSwap", 3, "medium")
    assert verdict(episode, [button], [], [button], [], [button]).index == 1
    assert verdict(episode, *[[button]] * 10).index == 1
