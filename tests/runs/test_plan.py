import io
import math
import tempfile
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from made_records import fill, make_record

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language import expressible, plain_settings
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record_codec import (
    StoreError,
    identity_key,
)
from roboirg.records.run_files import PLAN_FILE
from roboirg.records.store import read_records
from roboirg.runs.plan.option_parsing import (
    parse_episodes,
    parse_numbers,
    parse_policies,
    parse_stages,
)
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_maker import make_plan, word_options
from roboirg.runs.plan.stored_plans import read_plan, write_plan
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.csv_text import csv_lines


@pytest.mark.parametrize(
    ("text", "episodes"),
    [
        pytest.param("4", (0, 1, 2, 3), id="count"),
        pytest.param("0,3,5-9", (0, 3, 5, 6, 7, 8, 9), id="list with a range"),
        pytest.param("7,", (7,), id="list of one"),
        pytest.param("all", tuple(range(100)), id="all of the split train"),
    ],
)
def test_episodes_are_given_as_a_count_a_list_ranges_or_all(text, episodes):
    assert parse_episodes(text, "train", ()) == episodes


def test_a_number_that_stands_twice_in_a_list_counts_once():
    assert parse_numbers("stage", "1,5,1") == (1, 5)


@pytest.mark.parametrize(
    "text",
    [
        "0", "-3", "010", "0,010", "a", "3-1", "5-0", "1.5", "", ",", "1,,b", "300000000",
        "0-999999999", "9" * 5000, "0," + "9" * 5000, "a" * 5000,
    ],
)  # fmt: skip
def test_a_text_that_is_no_list_of_episodes_is_refused_in_one_short_sentence(text):
    with pytest.raises(InvalidValueError) as caught:
        parse_episodes(text, "test", ())
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


ALL_TASKS = tuple(all_tasks())


@pytest.mark.parametrize(
    ("text", "episodes"),
    [
        ("hard", tuple(range(3, 50, 4))),
        ("hard, medium", tuple(sorted([*range(3, 50, 4), *range(2, 50, 4)]))),
        ("hard,0,3", (*range(3, 50, 4), 0)),
    ],
)
def test_a_difficulty_selects_the_episodes_that_have_it(text, episodes):
    """In the split *test* every fourth is hard, 3, 7, ..., and those before are medium."""
    assert parse_episodes(text, "test", ALL_TASKS) == episodes


def test_a_difficulty_selects_an_episode_only_if_it_has_it_in_every_task():
    """In the split *val* tasks have their difficulties in another order in part."""
    in_all = parse_episodes("hard", "val", ALL_TASKS)
    in_one = parse_episodes("hard", "val", ("BinFill",))

    assert set(in_all) < set(in_one)


def test_a_difficulty_of_the_endless_random_split_is_refused():
    with pytest.raises(InvalidValueError, match="say how many"):
        parse_episodes("hard", "random", ALL_TASKS)


@pytest.mark.parametrize(
    ("parse", "given", "words"),
    [
        (parse_episodes, ("all", "random", ()), "'random' has .* say how many"),
        (parse_episodes, ("0", "test", ()), r"for episode 0 alone write '0,'\.$"),
        (parse_episodes, ("3,0-999999999,5", "train", ()), "split 'train' has episodes 0 to 99"),
        (parse_stages, ("5-1",), "1,5; 1,2,5; 1,2,3,5; 1,2,3,4,5"),
        (lambda text: word_options(stages=text), ("1,5;1-5",), "is '1,5;1-5'; here it must be one"),
        (parse_numbers, ("policy seed", "0-999999999"), "1,000,000,000 numbers; at most 10,000"),
    ],
)
def test_a_refused_list_of_numbers_comes_with_what_to_write_instead(parse, given, words):
    with pytest.raises(InvalidValueError, match=words):
        parse(*given)


@pytest.mark.parametrize("text", ["all", "ALL", "all,explicit", "direct, All"])
def test_the_word_all_in_a_list_of_settings_stands_for_everything_in_any_case(text):
    assert make_plan(["random"], settings=text, episodes="1").settings == ("all",)


@pytest.mark.parametrize("text", ["all", "ALL", "all,BinFill", "StopCube, All"])
def test_the_word_all_in_a_list_of_tasks_stands_for_everything_in_any_case(text):
    assert make_plan(["random"], tasks=text, episodes="1").tasks == ALL_TASKS


@pytest.mark.parametrize(
    ("text", "tasks"),
    [
        ("all", ALL_TASKS),
        ("PickByCount,Real", ("PickByCount", "PutInBox")),
        ("real, all", (*ALL_TASKS, "PutInBox", "PickByCount")),
    ],
)
def test_tasks_of_the_real_study_are_played_only_if_named_by_task_or_suite(text, tasks):
    """PutInBox and PickByCount are the suite *real*; *all* are the benchmark's tasks alone."""
    assert make_plan(["random"], tasks=text, episodes="1").tasks == tasks


def test_an_unknown_suite_is_refused_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match=r"no task 'reall'.*Did you mean 'real'"):
        make_plan(["random"], tasks="all,reall")


@pytest.mark.parametrize("task", ALL_TASKS)
def test_a_plan_plays_each_episode_in_every_setting_that_can_express_it_explicit_last(task):
    """A setting is a way to put an instruction; not every scene can be told in each.

    `expressible` has explicit first.
    """
    jobs = make_plan(["random"], tasks=task, episodes="6").jobs()

    for episode in range(6):
        possible = expressible(get_episode(task, "test", episode))
        explicit, *implicit = [setting for setting in possible if setting in plain_settings()]
        played = [job.setting for job in jobs if job.episode == episode]
        assert played == [*implicit, explicit]


def test_options_that_leave_the_words_as_they_are_add_no_episode():
    """Explicit has one form only, stages count in contextual, a frame in spatial instructions."""
    plan = make_plan(["random"], forms="implicit,resolved", stages="1,5", frame="camera")
    jobs = plan.jobs()

    assert len(set(jobs)) == len(jobs)
    assert {job.form for job in jobs if job.setting == "explicit"} == {"implicit"}
    for job in jobs:
        assert (job.options.stages == (1, 5)) == (job.setting == "contextual")
        assert (job.options.frame == "camera") == (job.setting == "spatial")


def test_an_instruction_in_turns_is_another_episode_unless_it_has_one_utterance():
    """Utterances come at once, as a prompt, or one by one. Explicit ones have only one."""
    prompt = make_plan(["random"], delivery="prompt").jobs()
    turns = make_plan(["random"], delivery="turns").jobs()

    for job, other in zip(prompt, turns, strict=True):
        is_same = job.setting == "explicit"
        assert (job == other) == is_same
        assert (identity_key(job) == identity_key(other)) == is_same
        assert (job.slug == other.slug) == is_same
        assert other.options.delivery == ("prompt" if is_same else "turns")


@pytest.mark.parametrize("text", ["every", "direct, Every", "all,every"])
def test_the_word_every_stands_for_all_settings_and_for_the_harder_ones(text):
    assert make_plan(["random"], settings=text).settings == ("every",)


def test_settings_every_adds_the_harder_settings_that_all_leaves_out():
    """*direct-rival* is harder: a second thing fits the words but for one property.

    Of these tasks, StopCube and BinFill, none has spatial instructions.
    """
    plan = make_plan(["random"], tasks="StopCube,BinFill", settings="every", episodes="0-3")

    told = set()
    for job in plan.jobs():
        told.add(job.setting)
        assert job.setting in expressible(get_episode(job.task, "test", job.episode))
    assert told > set(plain_settings()) - {"spatial"}
    assert "direct-rival" in told


def test_a_setting_in_turns_is_added_to_its_usual_delivery():
    """Two episodes of *direct* in turns, next to those at once; explicit has nothing to add."""
    options = {"tasks": "StopCube", "episodes": "2", "settings": "explicit,direct,reasoning"}
    usual = make_plan(["random"], **options).jobs()
    both = make_plan(["random"], in_turns="direct", **options).jobs()

    added = [job for job in both if job not in usual]

    assert [(job.setting, job.options.delivery) for job in added] == [("direct", "turns")] * 2
    assert len(both) == len(usual) + 2
    with pytest.raises(UnknownNameError, match="no setting in turns 'explicit'"):
        make_plan(["random"], in_turns="explicit", **options)


def test_an_episode_that_lacks_what_a_setting_needs_is_left_out():
    """*direct-rival* needs a second thing that nearly fits the words."""
    options = {"tasks": "BinFill", "settings": "explicit,direct-rival", "episodes": "0-7"}

    jobs = make_plan(["random"], **options).checked().jobs()

    with_rival = [job.episode for job in jobs if job.setting == "direct-rival"]
    assert 0 < len(with_rival) < 8
    assert [job.episode for job in jobs if job.setting == "explicit"] == list(range(8))
    with pytest.raises(InvalidValueError, match="nothing to play: grounded cannot"):
        make_plan(["random"], tasks="PickXtimes", settings="grounded", episodes="1").checked()


def test_settings_of_a_list_are_played_in_its_order():
    jobs = make_plan(["random"], tasks="BinFill", settings="spatial,direct", episodes="1").jobs()
    assert [job.setting for job in jobs] == ["spatial", "direct"]


@pytest.mark.parametrize(
    ("settings", "rest"), [("explicit,spatial,direct", "explicit,direct"), ("spatial", "all")]
)
def test_a_setting_in_a_list_that_a_task_lacks_is_refused_with_what_plays_the_rest(settings, rest):
    with pytest.raises(InvalidValueError) as caught:
        make_plan(["random"], tasks="StopCube,BinFill,VideoRepick", settings=settings)

    assert str(caught.value) == (
        "There is no spatial setting in StopCube, VideoRepick, but in PickXtimes, SwingXtimes, "
        "BinFill, VideoUnmaskSwap, VideoUnmask, ButtonUnmaskSwap, ButtonUnmask, PutInBox, "
        f"PickByCount; for the rest give --settings {rest}."
    )


@pytest.mark.parametrize(
    ("option", "typed"),
    [
        ("forms", "both"), ("split", "random"), ("episodes", "easy"), ("episodes", "all"),
        ("arms", "told,other-goal,silent,silent-empty,scrambled,paraphrase:2,again"),
        ("stages", "1,5;1-5"), ("wordings", "train"), ("video", "failures"),
        ("long_prompts", "refuse"),
    ],
)  # fmt: skip
def test_what_the_help_of_an_option_names_is_a_value_of_it(option, typed):
    """Help said "implicit, resolved or both", and both was refused."""
    assert make_plan(["random"], tasks="PickXtimes", settings="explicit", **{option: typed})


def test_both_forms_are_the_two_that_there_are():
    made = make_plan(["random"], tasks="PickXtimes", settings="direct", forms="both")
    assert made.forms == ("implicit", "resolved")


def test_episodes_are_played_in_the_given_order_with_explicit_words_last_in_each_scene():
    """So that no policy hears a scene's goal in plain words before it had to work it out.

    Plain are explicit words, and the *resolved* form, in which references are spelled out. False
    is before True in what is compared: random before oracle, VideoUnmask before BinFill, episode 3
    before 0.
    """
    jobs = make_plan(
        ["random", "oracle"], tasks="VideoUnmask,BinFill", episodes="3,0", policy_seeds="2,0",
        forms="resolved,implicit",
    ).jobs()  # fmt: skip

    order = []
    for job in jobs:
        is_plain = job.setting == "explicit" or job.form == "resolved"
        order.append((job.policy == "oracle", job.task == "BinFill", job.episode == 0, is_plain))
    assert order == sorted(order)
    assert len({job.slug for job in jobs}) == len(jobs)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"tasks": "PickXtime"}, r"no task 'PickXtime'.*Did you mean 'PickXtimes'\?"),
        ({"settings": "contextal"}, r"no setting 'contextal'.*Did you mean 'contextual'\?"),
        ({"split": "tests"}, r"no split 'tests'.*Did you mean 'test'\?"),
        ({"forms": "resolve"}, r"no form 'resolve'.*Did you mean 'resolved'\?"),
        ({"episodes": "0,50,3"}, r"no episode 50: split 'test' has episodes 0 to 49"),
        ({"video": "on"}, r"video is 'on'; it must be 'off', 'failures' or 'all'"),
        ({"retry_on": "none,policy"}, r"no kind of error 'none'"),
        ({"stages": "2,5"}, r"stages \(2, 5\)"),
        ({"distractor": "loud"}, r"no distractor 'loud'"),
        ({"frame": "world"}, r"no frame 'world'"),
        ({"settings": "explicit", "delivery": "turn"}, r"no delivery 'turn'.*'turns'"),
        ({"settings": "direct-rivals"}, r"no setting 'direct-rivals'.*'direct-rival'"),
        ({"max_steps": 0}, r"max_steps is 0; it must be a whole number from 1 to 1,000,000,000"),
        ({"max_steps": 10**22}, r"max_steps is 10{22}; it must be a whole number from 1"),
        ({"tries": 10**22}, r"tries is 10{22}; it must be at most 1000000000"),
        ({"policy_seeds": 10**22}, r"'10{22}' is not a valid policy seed"),
        ({"max_cost": math.inf}, r"max_cost is inf; it must be a finite number"),
        ({"cluster": {"memory_gb": 1e300}}, r"memory_gb is 1e\+300; it must be at most 1000000000"),
        ({"max_steps": True}, r"max_steps is 'True'; it must be a whole number"),
        ({"policy_timeout_s": True}, r"policy_timeout_s is 'True'; it must be a number"),
        ({"tasks": None}, r"No task was given"),
        ({"forms": []}, r"No form was given"),
        ({"episodes": []}, r"No episode was given"),
        ({"episodes": [True]}, r"'True' is not a valid episode"),
        ({"episodes": 2.0}, r"'2.0' is not a valid episode"),
        ({"devices": ""}, r"No device was given"),
        ({"max_steps": "many"}, r"max_steps is 'many'"),
        ({"max_steps": "1_0"}, r"max_steps is '1_0'; write the number without underscores"),
        ({"max_cost": "1_0.5"}, r"max_cost is '1_0.5'; write the number without underscores"),
        ({"max_steps": 9, "environment": {"max_steps": 8}},
         r"max_steps is 9, but stands in environment, too"),
    ],
)  # fmt: skip
def test_a_plan_with_an_impossible_option_is_refused_with_the_reason(options, sentence):
    with pytest.raises(InvalidValueError, match=sentence):
        make_plan(["random"], **options)


@pytest.mark.parametrize(
    "name",
    ["tasks", "settings", "in_turns", "forms", "episodes", "policy_seeds", "arms", "stages",
     "devices", "policy_env", "retry_on"],
)  # fmt: skip
@pytest.mark.parametrize("given", [{"1-5": 3}, {1: 3}, {}], ids=str)
def test_a_mapping_where_a_list_belongs_is_refused(name, given):
    """As a list, its keys would be taken, and its values lost."""
    with pytest.raises(InvalidValueError, match=r"\{.*\} is not a valid .*; write a list"):
        make_plan(["random"], **{name: given})


def test_a_plan_takes_numbers_and_arrays_of_numpy():
    options = {"tasks": "PickXtimes", "settings": "explicit"}
    plan = make_plan("random", episodes=np.int64(2), max_steps=np.int32(60), **options)

    assert (plan.episodes, plan.environment.max_steps) == ((0, 1), 60)
    assert make_plan("random", episodes=np.arange(1, 3), **options).episodes == (1, 2)


ANY_NUMBERS = st.integers(-(10**25), 10**25) | st.integers(-2, 200) | st.floats() | st.booleans()


@given(
    st.dictionaries(
        st.sampled_from([
            "max_steps", "observe_every", "demonstration_frames", "policy_seeds", "tries", "batch",
            "policy_timeout_s", "episode_timeout_s", "max_cost", "devices", "distractors",
        ]),
        ANY_NUMBERS | ANY_NUMBERS.map(str),
        min_size=1,
        max_size=3,
    )
)  # fmt: skip
@example({"max_steps": 10**9, "policy_seeds": 10**18 - 1, "max_cost": 1e308})
@settings(deadline=None)
def test_a_plan_with_any_numbers_is_refused_or_read_back_as_it_was_written(numbers):
    usual = {"tasks": "PickXtimes", "settings": "explicit", "episodes": 1}
    try:
        plan = make_plan("random", **usual, **numbers)
    except InvalidValueError:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_plan(plan, folder)
        assert read_plan(folder) == plan
        stored = [make_record(job) for job in plan.jobs()]
        assert list(read_records(fill(folder, *stored))) == stored


def test_commas_separate_policies_but_not_the_servers_of_one_policy():
    specs = ["random,oracle", "mme-vla://a:8001,b:8001?history=no", "random"]
    assert parse_policies(specs) == ("random", "oracle", "mme-vla://a:8001,b:8001?history=no")
    with pytest.raises(InvalidValueError, match="No policy was given"):
        parse_policies([])


def test_name_equals_spec_gives_a_policy_a_name():
    address = "mme-vla://localhost:8001?history=no"

    plan = make_plan([f"pi0.5={address}", "oracle"], tasks="StopCube", episodes="1")

    assert [(policy.name, policy.spec) for policy in plan.policies] == [
        ("pi0.5", address), ("oracle", "oracle"),
    ]  # fmt: skip
    assert plan.jobs()[0].policy == "pi0.5"


@pytest.mark.parametrize(
    ("policies", "error", "words"),
    [
        (
            ["a=oracle", "a=random"],
            InvalidValueError,
            "Two policies are named 'a': oracle and random",
        ),
        (["mine=listner"], UnknownNameError, "Did you mean 'listener'"),
    ],
)
def test_a_name_given_twice_or_to_an_unknown_policy_is_refused(policies, error, words):
    with pytest.raises(error, match=words):
        make_plan(policies)


@pytest.mark.parametrize("policy", ["-x=oracle", "=cmd|' /C calc'!A0"])
def test_a_policy_name_that_a_shell_or_a_spreadsheet_would_execute_is_refused(policy):
    with pytest.raises(InvalidValueError, match="name"):
        make_plan(policy, tasks="PickXtimes", episodes="1")


@pytest.mark.parametrize(
    "name",
    ["", " ", "NA", "<NA>", "n/a", "#N/A N/A", "null", "nan", "None", "007", "7.0", "1,000", ".5",
     "1e5", "2.5E-3", "inf", "True", "1.#IND"],
)  # fmt: skip
def test_a_policy_name_that_pandas_would_read_as_missing_or_a_number_is_refused(name, tmp_path):
    """By plans, and by files of records that come from elsewhere."""
    with pytest.raises(InvalidValueError, match=f"Policy '{name}' has no valid name for records"):
        make_plan([replace(read_policy("random"), name=name)], tasks="PickXtimes", episodes="1")

    record = make_record(Plan(policies="random", tasks="PickXtimes", episodes=1).jobs()[0])
    stranger = msgspec.structs.replace(record, policy=name)
    with pytest.raises(StoreError, match="a missing value"):
        fill(tmp_path, stranger)


def test_a_policy_name_that_only_resembles_a_number_is_allowed_and_read_back_from_csv():
    names = ("e1", "7b", "na1", "pi0.5", "nan-net", "3d", "1e5x")
    plan = make_plan([f"{name}=random" for name in names], tasks="PickXtimes", episodes="1")
    assert tuple(policy.name for policy in plan.policies) == names

    table = csv_lines([["name"], *([name] for name in names)])
    assert (*pd.read_csv(io.StringIO(table))["name"],) == names


@pytest.mark.parametrize("content", ["{", "words", "[]"])
def test_a_broken_plan_file_in_a_run_is_reported_and_counts_as_no_plan(content, tmp_path, caplog):
    (tmp_path / PLAN_FILE).write_text(content)

    assert read_plan(tmp_path) is None
    assert caplog.messages == [
        f"{tmp_path / PLAN_FILE} is not a readable plan, so its missing episodes are not counted."
    ]


def test_a_run_that_has_no_plan_file_is_not_reported(tmp_path, caplog):
    assert read_plan(tmp_path) is None
    assert caplog.messages == []


def test_a_setting_named_next_to_all_is_added_for_the_tasks_that_have_it():
    """*grounded* asks where a thing is; StopCube has no such setting."""
    plan = make_plan(
        ["random"], tasks="StopCube,VideoUnmask", settings="grounded,All", episodes="2"
    )
    assert plan.setting_names == (*plain_settings(), "grounded")

    played = {(job.task, job.options.setting) for job in plan.jobs()}
    assert ("VideoUnmask", "grounded") in played
    assert ("StopCube", "direct") in played
    assert ("StopCube", "grounded") not in played
