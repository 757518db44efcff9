"""Plans: balanced for any seed, interleaved, and a seed changes the order and nothing else."""

from collections import Counter
from dataclasses import replace
from itertools import groupby

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.apps.real.pages.arrangement_svg import draw_svg
from roboirg.apps.real.pages.trial_sheet import sheet_text
from roboirg.apps.real.study.counterbalancing import (
    Arrangement,
    counterbalanced_order,
    read_arrangement,
)
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_csv import demonstrations_csv, trials_csv
from roboirg.apps.real.study.study_plan import (
    make_study,
    read_study,
    write_study,
)
from roboirg.core.errors import InvalidValueError
from roboirg.language.settings import plain_settings
from roboirg.tasks.splits.splits import get_episode

TASKS = ("PutInBox", "PickByCount")
SETTINGS = plain_settings()

studies = st.fixed_dictionaries(
    {
        "policies": st.lists(
            st.sampled_from(["listener", "forgetful", "pi0.5", "a:B"]), min_size=1, unique=True
        ),
        "tasks": st.lists(st.sampled_from(TASKS), min_size=1, unique=True),
        "settings": st.lists(st.sampled_from(SETTINGS), min_size=1, unique=True),
        "trials": st.integers(1, 24),
        "demonstrations": st.sampled_from([0, 1, 7, 50]),
        "seed": st.integers(0, 2**63 - 1),
    }
)


def spread(counts, values):
    """Return how much more often the most frequent of some values occurs than the rarest."""
    return max(counts[value] for value in values) - min(counts[value] for value in values)


def check_balance(task, episodes):
    """Check that arrangements, and each of their factors, occur equally often but for one."""
    possible = counterbalanced_order(task)
    arrangements = [read_arrangement(episode) for episode in episodes]
    assert spread(Counter(arrangements), possible) <= 1
    for factor in ("color", "left", "repeats"):
        counts = Counter(getattr(arrangement, factor) for arrangement in arrangements)
        assert spread(counts, {getattr(each, factor) for each in possible}) <= 1, factor
    sides = Counter(arrangement.side for arrangement in arrangements)
    assert spread(sides, ("left", "right")) <= 2


def episodes_by_condition(study):
    """Return the episodes of each task, setting and policy of a study, by their numbers."""
    found = {}
    for trial in make_study(**study).trials:
        condition = (trial.job.task, trial.job.setting, trial.job.policy)
        found.setdefault(condition, {})[trial.episode.index] = trial.episode
    return found


@settings(max_examples=15)
@given(study=studies)
def test_each_condition_meets_the_same_arrangements(study):
    """A condition is a task, a setting and a policy; an arrangement is how the table is laid, which
    follows from the episode's number. Of a task, all conditions have those of the first one."""
    first_of_task = {}

    for (task, _, _), episodes in episodes_by_condition(study).items():
        assert episodes.keys() == first_of_task.setdefault(task, episodes).keys()


@settings(max_examples=15)
@given(study=studies)
def test_the_arrangements_of_each_condition_are_balanced(study):
    """A condition is a task, a setting and a policy. `check_balance` counts how often its trials
    have each arrangement of the table, color, left object and number: these differ by one at most,
    as a condition can have more trials than there are arrangements, and left and right by two.
    """
    for (task, _, _), episodes in episodes_by_condition(study).items():
        check_balance(task, episodes.values())


@settings(max_examples=15)
@given(study=studies)
def test_demonstrations_have_balanced_arrangements_and_none_is_shown_twice(study):
    """Demonstrations show the tasks to a policy before the study. An arrangement is how the table
    is laid; `check_balance` counts how often each occurs, and each color, number and side.
    """
    plan = make_study(**study)

    for task in {demonstration.task for demonstration in plan.demonstrations}:
        episodes = [shown.episode for shown in plan.demonstrations if shown.task == task]
        assert len({episode.index for episode in episodes}) == len(episodes)
        check_balance(task, episodes)


@settings(max_examples=15)
@given(study=studies)
def test_each_block_has_each_condition_once_on_one_arrangement(study):
    """Of the policies in all settings, one after the other; blocks are numbered from 1 on."""
    blocks = [list(trials) for _, trials in groupby(make_study(**study).trials, by_block)]

    first = sorted((trial.job.setting, trial.job.policy) for trial in blocks[0])
    assert len(set(first)) == len(first)
    for number, trials in enumerate(blocks, start=1):
        assert {trial.block for trial in trials} == {number}
        assert len({(trial.job.task, trial.job.episode) for trial in trials}) == 1
        assert sorted((trial.job.setting, trial.job.policy) for trial in trials) == first


def by_block(trial):
    return trial.block


@pytest.mark.parametrize("seed", [0, 1])
def test_tasks_take_turns_from_block_to_block(seed):
    """Two tasks, three trials each: six blocks, of which each pair has both tasks, in any order."""
    plan = make_study(("a",), tasks=TASKS, trials=3, demonstrations=0, seed=seed)

    tasks = [next(trials).job.task for _, trials in groupby(plan.trials, by_block)]

    assert [set(tasks[start : start + 2]) for start in (0, 2, 4)] == [set(TASKS)] * 3


@settings(max_examples=15)
@given(study=studies, seed=st.integers(0, 2**63 - 1))
def test_a_seed_changes_the_order_of_trials_and_nothing_else(study, seed):
    """Two studies that differ in the seed have the same trials, demonstrations and twins."""
    plan = make_study(**study)

    other = make_study(**{**study, "seed": seed})

    assert make_study(**study) == plan
    assert {(trial.name, trial.job) for trial in other.trials} == {
        (trial.name, trial.job) for trial in plan.trials
    }
    assert set(other.demonstrations) == set(plan.demonstrations)
    assert other.twin_plans == plan.twin_plans


def test_no_condition_is_early_or_late_on_average():
    """Five settings and two policies are ten conditions, in a random order in each block.

    So each is the first in a tenth of 800 blocks (40 seeds, two tasks, ten trials): 80 times, with
    a standard deviation of 8.5. Below 50 or above 110 is more than three of these away.
    """
    first = Counter()
    for seed in range(40):
        plan = make_study(("a", "b"), tasks=TASKS, trials=10, demonstrations=0, seed=seed)
        for _, trials in groupby(plan.trials, by_block):
            job = next(trials).job
            first[job.setting, job.policy] += 1

    assert len(first) == 10
    assert min(first.values()) >= 50
    assert max(first.values()) <= 110


def test_the_papers_study_is_the_default():
    """Two tasks, five settings, ten trials of each, and 50 demonstrations of a task."""
    plan = make_study(("a", "b"), tasks=TASKS)

    assert len(plan.trials) == 2 * 5 * 10 * 2
    assert len(plan.demonstrations) == 2 * 50


@pytest.mark.parametrize(("task", "number"), [("PutInBox", 4), ("PickByCount", 8)])
def test_all_arrangements_are_there_once(task, number):
    """A task can be laid out in so many ways; a round of the order has each of them once."""
    order = counterbalanced_order(task)
    assert len(set(order)) == len(order) == number


@pytest.mark.parametrize(
    ("policies", "options", "words"),
    [
        ("a", {"tasks": ("PickByCount",), "trials": 50}, "too many for the split 'val'; at most 2"),
        ("aa", {}, "'a' is given twice"),
        ("a", {"tasks": ("PickXtimes",)}, "PickXtimes is not a task for a real robot"),
        ("a", {"settings": ("direct", "spatail")}, "no setting of PutInBox 'spatail'"),
        ("a", {"trials": 0}, "trials is 0; it must be a whole number from 1"),
    ],
)
def test_a_study_that_cannot_be_is_refused_with_the_reason(policies, options, words):
    with pytest.raises(InvalidValueError, match=words):
        make_study(tuple(policies), **{"tasks": TASKS, **options})


def small_study(demonstrations):
    """Return a study of one trial of each task in each setting."""
    return make_study(("a",), tasks=TASKS, trials=1, demonstrations=demonstrations)


def test_a_plan_is_read_as_it_was_written_and_may_be_written_again(tmp_path):
    write_study(small_study(demonstrations=1), tmp_path)
    write_study(small_study(demonstrations=1), tmp_path)

    assert read_study(tmp_path) == small_study(demonstrations=1)


def test_a_plan_is_not_overwritten_by_another(tmp_path):
    write_study(small_study(demonstrations=1), tmp_path)
    with pytest.raises(InvalidValueError, match="holds another plan"):
        write_study(small_study(demonstrations=2), tmp_path)


def test_a_folder_without_a_plan_is_refused(tmp_path):
    with pytest.raises(InvalidValueError, match="There is no plan in"):
        read_study(tmp_path)


def test_the_plan_of_a_run_is_refused_as_the_plan_of_a_study(tmp_path):
    (tmp_path / "plan.json").write_text('{"policies": ["oracle"]}')
    with pytest.raises(InvalidValueError, match="is not the plan of a real-robot study"):
        read_study(tmp_path)


@settings(max_examples=10)
@given(study=studies)
def test_the_plans_for_the_twin_have_the_trials_and_no_others(study):
    """The twin is the same study in simulation. No two trials have the same name."""
    plan = make_study(**study)

    played = []
    for twin in plan.twin_plans.values():
        played += [msgspec.structs.replace(job, ref=None) for job in twin.jobs()]

    assert len(played) == len(plan.trials) == len({trial.name for trial in plan.trials})
    assert set(played) == {trial.identity for trial in plan.trials}


def test_csv_says_what_the_plan_says(snapshot):
    """The snapshot has the two tables of a plan of two policies: its trials and demonstrations."""
    plan = make_study(("a", "b"), tasks=TASKS, trials=2, demonstrations=2)
    assert trials_csv(plan) + demonstrations_csv(plan) == snapshot


@pytest.mark.parametrize("task", TASKS)
def test_the_drawing_has_the_robot_s_left_on_the_left(task, snapshot):
    """The snapshot has the drawing of a scene as SVG."""
    (trial,) = make_study(("a",), tasks=(task,), settings=("direct",), trials=1).trials
    assert draw_svg(trial.episode.scene) == snapshot


def test_the_sheet_has_its_texts_and_drawings_in_their_places(snapshot):
    """The snapshot has the page for operators, with names in the place of drawings."""
    plan = make_study("ab", tasks=TASKS, trials=1, demonstrations=2)
    page = sheet_text(plan)

    for trial in (*plan.trials, *plan.demonstrations):
        page = page.replace(draw_svg(trial.episode.scene), f"[drawing of {trial.name}]")

    assert page == snapshot


def test_a_turned_box_is_drawn_counter_clockwise():
    """0.5 rad are 28.6 degrees. In SVG positive angles turn clockwise, hence the minus."""
    scene = get_episode("PutInBox", "val", 0).scene
    (box, *_) = (thing for thing in scene.objects if thing.kind == "box")

    turned = replace(box, yaw=0.5)

    assert "rotate(-28.6)" in draw_svg(replace(scene, objects=(turned,)))


@pytest.mark.parametrize(
    ("task", "grounding"),
    [("PutInBox", {"wrong_place"}), ("PickByCount", {"wrong_object", "wrong_count"})],
)
def test_operators_choose_among_the_failures_of_the_task(task, grounding):
    """Those of grounding differ from task to task, the others do not."""
    plan = make_study(("a",), tasks=(task,), settings=("direct",), trials=1, demonstrations=0)

    failures = [choice.failure for choice in failure_choices(plan.trials[0].episode)]

    others = ["missed_grasp", "dropped", "misplaced", "out_of_time", "stopped", "no_attempt"]
    assert failures[-6:] == others
    assert set(failures[:-6]) == grounding


@pytest.mark.parametrize("task", TASKS)
def test_each_failure_has_a_key_of_its_own_and_wrong_things_are_not_the_one_meant(task):
    """Operators choose among failures by keys. A failure "wrong place" or "wrong object" names a
    color, which must not be that of the goal.
    """
    for trial in make_study(("a",), tasks=(task,), trials=8, demonstrations=0).trials:
        choices = failure_choices(trial.episode)
        assert len({choice.key for choice in choices}) == len(choices)
        for choice in choices:
            if choice.failure in ("wrong_place", "wrong_object"):
                assert str(trial.episode.goal["color"]) not in choice.words, trial.name


@pytest.mark.parametrize(("left", "side"), [("green", "left"), ("purple", "right")])
def test_the_side_of_a_green_target_follows_from_the_color_at_the_left(left, side):
    """If green is at the left, the target is there; with another color there, it is at the
    right.
    """
    assert Arrangement(color="green", left=left).side == side
