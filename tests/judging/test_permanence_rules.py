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
    begin = [*PRESSES[task], [lifted(first)], []]
    end = [[put_down(first)], [], [lifted(second)]]
    assert verdict(episode, *begin, *end).status is Status.SUCCESS
    assert verdict(episode, *begin, *end[:-1]).status is Status.ONGOING


@each_task
def test_any_other_container_fails_the_putting_down_and_the_second_pick(task, seed):
    episode, first, second, others = hard(task, seed)
    begin = [*PRESSES[task], [lifted(first)]]
    for wrong in (second, *others):
        judge = verdict(episode, *begin, [put_down(first), lifted(wrong)])
        assert judge.status is Status.FAILURE
        assert str(judge.cause).endswith("; expected: put down the container")
    for wrong in (first, *others):
        judge = verdict(episode, *begin, [put_down(first)], [lifted(wrong)])
        assert judge.status is Status.FAILURE


@each_task
def test_the_container_that_is_held_or_lifted_again_before_it_is_down_is_fine(task, seed):
    episode, first, second, _ = hard(task, seed)
    steps = [*PRESSES[task], *[[lifted(first)]] * 5, [], [lifted(first)], []]
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
    looked = [[lifted(name)] for name in (first, second, *others)]
    pressed = [facts for press in PRESSES[task] if press for facts in (everything, press)]
    judge = verdict(episode, *looked, *pressed, [lifted(first)], [put_down(first)])
    assert judge.status is Status.ONGOING
    judge.update(100, frozenset([lifted(second)]))
    assert judge.status is Status.SUCCESS


@each_button_task
def test_what_is_up_after_the_last_press_counts_one_step_later(task, seed):
    episode = make_episode(task, seed, "medium")
    (target,), others = named(episode)
    *before, last = [press for press in PRESSES[task] if press]
    for up, outcome in ((target, Status.SUCCESS), (others[0], Status.FAILURE)):
        judge = verdict(episode, *before, [*last, lifted(up)])
        assert judge.status is Status.ONGOING
        judge.update(100, frozenset([lifted(up)]))
        assert judge.status is outcome


@each_button_task
def test_pressing_again_later_has_no_effect(task, seed):
    episode, first, second, _ = hard(task, seed)
    again = [press for press in PRESSES[task] if press]
    steps = [*PRESSES[task], *again, [lifted(first)], *again, [put_down(first)], *again]
    assert verdict(episode, *steps).status is Status.ONGOING
    assert verdict(episode, *steps, [lifted(second)]).status is Status.SUCCESS


@pytest.mark.parametrize("order", [(LEFT, RIGHT), (RIGHT, LEFT)])
@pytest.mark.parametrize("between", [[], [[]]])
def test_both_buttons_in_any_order(order, between):
    episode = make_episode("ButtonUnmaskSwap", 3, "medium")
    one, other = order
    assert verdict(episode, [one]).index == 1
    assert verdict(episode, [one], *between, [other]).index == 2
    # Already the other one while the first is still down.
    assert verdict(episode, [one], [one, other]).index == 2


@pytest.mark.parametrize("button", [LEFT, RIGHT])
def test_one_button_twice_or_held_is_not_both(button):
    episode = make_episode("ButtonUnmaskSwap", 3, "medium")
    assert verdict(episode, [button], [], [button], [], [button]).index == 1
    assert verdict(episode, *[[button]] * 10).index == 1
