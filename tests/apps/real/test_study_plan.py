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
        "seed": st.integers(0, 2**63),
    }
)


def spread(counts, everything):
    return max(counts[cell] for cell in everything) - min(counts[cell] for cell in everything)


def arrangement_counts(episodes):
    """Count arrangements and their factors."""
    arrangements = [read_arrangement(episode) for episode in episodes]
    counts = {"arrangement": Counter(arrangements)}
    for name in ("color", "left", "repeats", "side"):
        counts[name] = Counter(getattr(arrangement, name) for arrangement in arrangements)
    return counts


def check_balance(task, episodes):
    found = arrangement_counts(episodes)
    orders = counterbalanced_order(task)
    assert spread(found["arrangement"], orders) <= 1
    for factor in ("color", "left", "repeats"):
        assert spread(found[factor], {getattr(order, factor) for order in orders}) <= 1, factor
    assert spread(found["side"], ("left", "right")) <= 2


@settings(max_examples=25)
@given(studies, st.integers(0, 2**63))
def test_plans_are_balanced_and_a_seed_changes_the_order_and_nothing_else(study, seed):
    plan = make_study(**study)
    check_arrangements(plan)
    check_blocks(plan)
    assert make_study(**study) == plan

    again = make_study(**{**study, "seed": seed})
    assert {(t.name, t.job) for t in again.trials} == {(t.name, t.job) for t in plan.trials}
    assert len({t.name for t in plan.trials}) == len(plan.trials) == len(again.trials)
    assert set(again.demonstrations) == set(plan.demonstrations)
    assert again.twin_plans == plan.twin_plans


def check_arrangements(plan):
    """Every condition meets the same balanced arrangements."""
    conditions = {}
    for trial in plan.trials:
        job = trial.job
        met = conditions.setdefault((job.task, job.setting, job.policy), {})
        met[trial.episode.index] = trial.episode
    for (task, _, _), met in conditions.items():
        check_balance(task, met.values())
        for (name, _, _), other in conditions.items():
            assert name != task or other.keys() == met.keys()
    for task in {demonstration.task for demonstration in plan.demonstrations}:
        chosen = [
            demonstration.episode
            for demonstration in plan.demonstrations
            if demonstration.task == task
        ]
        assert len({episode.index for episode in chosen}) == len(chosen)
        check_balance(task, chosen)


def check_blocks(plan):
    """Every block has every condition once, on one arrangement."""
    blocks = [list(trials) for _, trials in groupby(plan.trials, key=lambda trial: trial.block)]
    conditions = conditions_of(blocks[0])
    assert set(conditions.values()) == {1}
    for number, trials in enumerate(blocks, 1):
        assert {trial.block for trial in trials} == {number}
        assert len({(trial.job.task, trial.job.episode) for trial in trials}) == 1
        assert conditions_of(trials) == conditions

    tasks = [trials[0].job.task for trials in blocks]
    in_turn = len(set(tasks))
    for start in range(0, len(tasks), in_turn):
        assert len(set(tasks[start : start + in_turn])) == in_turn


def conditions_of(trials):
    return Counter((trial.job.setting, trial.job.policy) for trial in trials)


def test_no_condition_is_early_or_late_on_average():
    # The order in a block is uniform: each condition is first in a tenth of 800 blocks.
    first = Counter()
    for seed in range(40):
        plan = make_study(("a", "b"), tasks=TASKS, trials=10, demonstrations=0, seed=seed)
        for _, trials in groupby(plan.trials, key=lambda trial: trial.block):
            job = next(trials).job
            first[job.setting, job.policy] += 1

    assert len(first) == 10
    assert all(50 <= count <= 110 for count in first.values()), first


def test_the_paper_s_study_is_the_default():
    plan = make_study(("a", "b"), tasks=TASKS)
    assert len(plan.trials) == 2 * 5 * 10 * 2
    assert len(plan.demonstrations) == 2 * 50


@pytest.mark.parametrize(("task", "number"), [("PutInBox", 4), ("PickByCount", 8)])
def test_all_arrangements_are_there(task, number):
    order = counterbalanced_order(task)
    assert len(set(order)) == len(order) == number


@pytest.mark.parametrize(
    ("policies", "options", "words"),
    [
        ("a", {"tasks": ("PickByCount",), "trials": 50}, "too many for the split 'val'; at most 2"),
        ("aa", {}, "'a' is given twice"),
        ("a", {"tasks": ("PickXtimes",)}, "PickXtimes is not a task for a real robot"),
        ("a", {"settings": ("direct", "spatail")}, "no setting of PutInBox 'spatail'"),
        (("NA",), {}, "Policy 'NA' has no valid name for records"),
        ("a", {"trials": 0}, "trials is 0; it must be a whole number from 1"),
        ("a", {"seed": -1}, "seed is -1; it must be a whole number from 0"),
    ],
)
def test_what_cannot_be_is_said(policies, options, words):
    with pytest.raises(InvalidValueError, match=words):
        make_study(tuple(policies), **{"tasks": TASKS, **options})


def test_a_plan_is_read_as_it_was_written_and_not_overwritten(tmp_path):
    plan = make_study(("a",), tasks=TASKS, trials=1, demonstrations=1)
    write_study(plan, tmp_path)
    write_study(plan, tmp_path)
    assert read_study(tmp_path) == plan
    with pytest.raises(InvalidValueError, match="holds another plan"):
        write_study(make_study(("a",), tasks=TASKS, trials=1, demonstrations=2), tmp_path)
    with pytest.raises(InvalidValueError, match="There is no plan in"):
        read_study(tmp_path / "elsewhere")

    (tmp_path / "plan.json").write_text('{"policies": ["oracle"]}')
    with pytest.raises(InvalidValueError, match="is not the plan of a real-robot study"):
        read_study(tmp_path)


@settings(max_examples=10)
@given(studies)
def test_the_plans_for_the_twin_have_the_trials_and_no_others(study):
    plan = make_study(**study)
    played = [
        msgspec.structs.replace(job, ref=None)
        for twin in plan.twin_plans.values()
        for job in twin.jobs()
    ]

    assert len(played) == len(plan.trials)
    assert set(played) == {trial.identity for trial in plan.trials}


def test_csv_says_what_the_plan_says(snapshot):
    plan = make_study(("a", "b"), tasks=TASKS, trials=2, demonstrations=2)
    assert trials_csv(plan) + demonstrations_csv(plan) == snapshot


@pytest.mark.parametrize("task", TASKS)
def test_the_drawing_has_the_robot_s_left_on_the_left(task, snapshot):
    (trial,) = make_study(("a",), tasks=(task,), settings=("direct",), trials=1).trials
    assert draw_svg(trial.episode.scene) == snapshot


def test_the_sheet_has_its_texts_and_drawings_in_their_places(snapshot):
    plan = make_study("ab", tasks=TASKS, trials=1, demonstrations=2)
    page = sheet_text(plan)

    for trial in (*plan.trials, *plan.demonstrations):
        page = page.replace(draw_svg(trial.episode.scene), f"[drawing of {trial.name}]")

    assert page == snapshot


def test_a_turned_box_is_drawn_counter_clockwise():
    scene = get_episode("PutInBox", "val", 0).scene
    (box, *_) = (thing for thing in scene.objects if thing.kind == "box")

    turned = replace(box, yaw=0.5)

    assert "rotate(-28.6)" in draw_svg(replace(scene, objects=(turned,)))


@pytest.mark.parametrize(
    ("task", "wrong"),
    [("PutInBox", {"wrong_place"}), ("PickByCount", {"wrong_object", "wrong_count"})],
)
def test_operators_choose_among_the_failures_of_the_task(task, wrong):
    for trial in make_study(("a",), tasks=(task,), trials=8, demonstrations=0).trials:
        choices = failure_choices(trial.episode)
        grounding = set()
        others = []
        for choice in choices:
            if choice.attribution().kind == "grounding":
                grounding.add(choice.failure)
            else:
                others.append(choice.failure)

        assert grounding == wrong
        assert others == [
            "missed_grasp", "dropped", "misplaced", "out_of_time", "stopped", "no_attempt",
        ]  # fmt: skip
        assert len({choice.key for choice in choices}) == len(choices)
        meant = str(trial.episode.goal["color"])
        for choice in choices:
            if choice.failure in ("wrong_place", "wrong_object"):
                assert meant not in choice.words


def test_sides_follow_from_colors():
    assert Arrangement("green", "green").side == "left"
    assert Arrangement("green", "purple").side == "right"
