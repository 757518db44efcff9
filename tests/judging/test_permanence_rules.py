"""The rules of the four Unmask tasks, driven by synthetic facts."""

from typing import NamedTuple

import pytest
from staged import judged

from roboirg.core.conditions import Fact
from roboirg.core.episode import Episode
from roboirg.judging import Status
from roboirg.tasks.splits.splits import make_episode

BUTTON, LEFT, RIGHT = (Fact("pressed", name) for name in ("button", "button_left", "button_right"))
PRESSES_OF = {
    "VideoUnmask": [],
    "VideoUnmaskSwap": [],
    "ButtonUnmask": [BUTTON],
    "ButtonUnmaskSwap": [LEFT, RIGHT],
}
each_task = pytest.mark.parametrize("task", PRESSES_OF)
each_button_task = pytest.mark.parametrize("task", ["ButtonUnmask", "ButtonUnmaskSwap"])


def lifted(name):
    return Fact("lifted", name)


def put_down(name):
    return Fact("put_down", name)


def presses_of(task):
    """Return the facts of the steps with which a task begins: a press, and a step without facts."""
    steps = []
    for press in PRESSES_OF[task]:
        steps += [[press], []]
    return steps


class UnmaskEpisode(NamedTuple):
    """An episode with the names of its containers: to lift first and second, and all others."""

    episode: Episode
    first: str
    second: str | None
    others: list[str]

    def judged_after(self, *steps):
        """Return the judge after steps in which these facts hold."""
        return judged(self.episode.stages, self.episode.scene, *steps)


def episode_with_picks(task, count):
    """Return an episode whose goal is one container, or two to be lifted one after the other."""
    episode = make_episode(task, 3, {1: "medium", 2: "hard"}[count])
    wanted = [episode.scene[f"cube_{color}"].inside for color in episode.goal.texts("colors")]
    names = [item.name for item in episode.scene.of_kind("container")]
    others = [name for name in names if name not in wanted]
    return UnmaskEpisode(episode, *[*wanted, None][:2], others)


def check_second_is_due(episode, *steps):
    """Check that the episode goes on after these steps and succeeds with a lift of the second."""
    assert episode.judged_after(*steps).status is Status.ONGOING
    assert episode.judged_after(*steps, [lifted(episode.second)]).status is Status.SUCCESS


@each_task
def test_one_pick_succeeds_when_the_container_over_the_cube_is_lifted(task):
    """The task begins with the presses of its buttons, if it has any (`presses_of`). Then the one
    container that hides the cube of the goal, `first`, is lifted."""
    episode = episode_with_picks(task, 1)

    judge = episode.judged_after(*presses_of(task), [], [lifted(episode.first)])

    assert judge.status is Status.SUCCESS
    assert judge.cause is None


@each_task
def test_two_picks_succeed_in_order_with_the_first_put_down_between(task):
    """The task begins with the presses of its buttons, if it has any (`presses_of`). Two containers
    are to be lifted, `first` and then `second`; each list has the facts of one step. Until the
    second one is lifted, the episode goes on."""
    episode = episode_with_picks(task, 2)
    up = [lifted(episode.first)]
    down = [put_down(episode.first)]

    check_second_is_due(episode, *presses_of(task), up, [], down, [])


@each_task
def test_lifting_another_container_before_the_first_is_put_down_fails(task):
    """After the presses of the task's buttons, the first container is lifted and has to be put
    down. In the very step in which it is, another one is lifted, be it the second one that is meant
    or one that never is (`others`)."""
    episode = episode_with_picks(task, 2)
    for wrong in (episode.second, *episode.others):
        up = [lifted(episode.first)]
        together = [put_down(episode.first), lifted(wrong)]

        judge = episode.judged_after(*presses_of(task), up, together)

        assert judge.status is Status.FAILURE, wrong
        assert judge.cause.endswith("; expected: put down the container"), wrong


@each_task
def test_lifting_a_wrong_container_as_the_second_one_fails(task):
    """After the presses of the task's buttons, the first container was lifted and put down, so the
    second one is due. To lift the first one again is as wrong as to lift one that is never meant
    (`others`)."""
    episode = episode_with_picks(task, 2)
    for wrong in (episode.first, *episode.others):
        judge = episode.judged_after(
            *presses_of(task), [lifted(episode.first)], [put_down(episode.first)], [lifted(wrong)]
        )

        assert judge.status is Status.FAILURE, wrong


@each_task
def test_holding_the_first_container_long_or_lifting_it_again_is_allowed(task):
    """After the presses of the task's buttons, the first container is up for four steps, down for
    one, and up again; an empty list is a step without facts. Then it is put down, and the second
    one lifted, as is meant."""
    episode = episode_with_picks(task, 2)
    up = [lifted(episode.first)]
    held = [*presses_of(task), up, up, up, up, [], up, []]

    check_second_is_due(episode, *held, [put_down(episode.first)])


@each_task
def test_putting_down_other_containers_does_not_complete_putting_down_the_first(task):
    """Two containers are to be lifted, one after the other. The first one is up; that others lie on
    the table does not count, so the stage before the last one, to put it down, stays due."""
    episode = episode_with_picks(task, 2)
    down = [put_down(name) for name in (episode.second, *episode.others)]

    judge = episode.judged_after(*presses_of(task), [lifted(episode.first)], down)

    assert (judge.status, judge.index) == (Status.ONGOING, len(episode.episode.stages) - 2)


@each_button_task
def test_before_the_button_is_pressed_any_container_may_be_lifted(task):
    """The task is to press its button, or its two buttons, and then to lift two containers in
    order. All containers are lifted before each press, which is allowed. Afterwards the two that
    are meant are lifted in order, which is a success."""
    episode = episode_with_picks(task, 2)
    up = [lifted(name) for name in (episode.first, episode.second, *episode.others)]
    early = []
    for press in PRESSES_OF[task]:
        early += [up, [press]]
    picks = [[lifted(episode.first)], [put_down(episode.first)], [lifted(episode.second)]]

    judge = episode.judged_after(*early, *picks)

    assert judge.status is Status.SUCCESS


@each_button_task
@pytest.mark.parametrize(
    ("is_meant", "status"),
    [(True, Status.SUCCESS), (False, Status.FAILURE)],
    ids=["the meant one", "another one"],
)
def test_a_container_that_is_up_during_the_last_press_counts_one_step_later(task, is_meant, status):
    """The task is to press its button, or its two buttons, and then to lift one container. A
    container is already up at the step of the last press. At this step it is the press that counts,
    so the episode goes on; a step later, the container decides."""
    episode = episode_with_picks(task, 1)
    up = lifted(episode.first if is_meant else episode.others[0])
    presses = [[press] for press in PRESSES_OF[task]]  # one press a step
    presses[-1].append(up)

    assert episode.judged_after(*presses).status is Status.ONGOING
    assert episode.judged_after(*presses, [up]).status is status


@each_button_task
def test_pressing_again_later_has_no_effect(task):
    """`again` presses all buttons of the task once more: at the beginning, while the first
    container is up, and after it was put down. The second container then still makes it a
    success."""
    episode = episode_with_picks(task, 2)
    again = [[press] for press in PRESSES_OF[task]]
    up = [lifted(episode.first)]
    down = [put_down(episode.first)]

    check_second_is_due(episode, *presses_of(task), *again, up, *again, down, *again)


def stages_complete_after(*steps):
    """Return how many stages are complete of a task that begins with a press of two buttons."""
    return episode_with_picks("ButtonUnmaskSwap", 1).judged_after(*steps).index


@pytest.mark.parametrize(("first", "other"), [(LEFT, RIGHT), (RIGHT, LEFT)])
def test_both_buttons_may_be_pressed_in_any_order(first, other):
    """Each list has the facts of one step, and the number counts completed stages, of which each
    press is one: with a step between, at once, or the other one while the first is still down."""
    assert stages_complete_after([first]) == 1
    assert stages_complete_after([first], [], [other]) == 2
    assert stages_complete_after([first], [other]) == 2
    assert stages_complete_after([first], [first, other]) == 2


@pytest.mark.parametrize("button", [LEFT, RIGHT])
def test_pressing_the_same_button_twice_completes_only_one_of_two_presses(button):
    """Two different buttons have to be pressed. One of them is pressed three times, or held for ten
    steps; each list has the facts of a step."""
    assert stages_complete_after([button], [], [button], [], [button]) == 1
    assert stages_complete_after(*[[button]] * 10) == 1
