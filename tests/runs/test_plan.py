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
)
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
    """A number alone is a count; with a comma it is a list. The split *train* has 100 episodes."""
    assert parse_episodes(text, "train", ()) == episodes


def test_a_number_that_stands_twice_in_a_list_counts_once():
    assert parse_numbers("stage", "1,5,1") == (1, 5)


@pytest.mark.parametrize(
    "text",
    ["0", "-3", "010", "0,010", "a", "3-1", "1.5", "", "1,,b", "0-999999999", "9" * 5000],
)
def test_a_text_that_is_no_list_of_episodes_is_refused_in_one_short_sentence(text):
    """*Short* is less than 200 characters, even for a number of 5,000 digits."""
    with pytest.raises(InvalidValueError) as caught:
        parse_episodes(text, "test", ())

    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


ALL_TASKS = tuple(all_tasks())


ONE_EPISODE = {"tasks": "PickXtimes", "episodes": "1"}


@pytest.mark.parametrize(
    ("text", "first_episodes"),
    [
        ("hard", (3, 7, 11, 15)),
        ("hard, medium", (2, 3, 6, 7)),
    ],
)
def test_a_difficulty_selects_the_episodes_that_have_it(text, first_episodes):
    """In the split *test* every fourth episode is hard, and each before a hard one is medium."""
    assert parse_episodes(text, "test", ALL_TASKS)[:4] == first_episodes


def test_a_number_next_to_a_difficulty_adds_that_episode():
    hard = parse_episodes("hard", "test", ALL_TASKS)

    assert parse_episodes("hard,0,3", "test", ALL_TASKS) == (*hard, 0)


def test_a_difficulty_selects_an_episode_only_if_it_has_it_in_every_task():
    """In the split *val* tasks have their difficulties in another order in part."""
    in_all = parse_episodes("hard", "val", ALL_TASKS)
    in_one = parse_episodes("hard", "val", ("BinFill",))

    assert set(in_all) < set(in_one)


def test_a_difficulty_of_the_endless_random_split_is_refused():
    with pytest.raises(InvalidValueError, match="say how many"):
        parse_episodes("hard", "random", ALL_TASKS)


@pytest.mark.parametrize(
    ("text", "split", "words"),
    [
        ("all", "random", "'random' has .* say how many"),
        ("0", "test", r"for episode 0 alone write '0,'\.$"),
        ("3,0-999999999,5", "train", "split 'train' has episodes 0 to 99"),
    ],
)
def test_a_refused_list_of_episodes_comes_with_what_to_write_instead(text, split, words):
    with pytest.raises(InvalidValueError, match=words):
        parse_episodes(text, split, ())


def test_two_lists_of_stages_are_refused_where_one_is_wanted():
    with pytest.raises(InvalidValueError, match="is '1,5;1-5'; here it must be one"):
        word_options(stages="1,5;1-5")


def test_a_range_of_too_many_numbers_is_refused_with_the_most_that_there_may_be():
    with pytest.raises(InvalidValueError, match="1,000,000,000 numbers; at most 10,000"):
        parse_numbers("policy seed", "0-999999999")


@pytest.mark.parametrize("text", ["all", "ALL", "all,explicit", "direct, All"])
def test_the_word_all_in_a_list_of_settings_stands_for_everything_in_any_case(text):
    assert make_plan(["random"], settings=text, **ONE_EPISODE).settings == ("all",)


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
    """A setting is a way to put an instruction; not every scene can be told in each."""
    jobs = make_plan(["random"], tasks=task, episodes="6").jobs()

    for number in range(6):
        episode = get_episode(task, "test", number)
        played = [job.setting for job in jobs if job.episode == number]
        assert set(played) == set(expressible(episode)) & set(plain_settings()), number
        assert played[-1] == "explicit"


@pytest.mark.parametrize(
    ("setting", "options", "episodes"),
    [
        ("explicit", {"forms": "implicit,resolved"}, 1),
        ("direct", {"forms": "implicit,resolved"}, 2),
        ("direct", {"stages": "1,5;1,2,5"}, 1),
        ("contextual", {"stages": "1,5;1,2,5"}, 2),
    ],
)
def test_options_that_leave_the_words_of_a_setting_as_they_are_add_no_episode(
    setting, options, episodes
):
    """Explicit instructions have one form only, and stages exist in contextual ones alone."""
    plan = make_plan(["random"], tasks="BinFill", settings=setting, episodes="1", **options)

    assert len(plan.jobs()) == episodes


@pytest.mark.parametrize(("setting", "frame"), [("spatial", "camera"), ("direct", "robot")])
def test_the_frame_of_reference_counts_in_spatial_instructions_alone(setting, frame):
    """*robot* is the default, which stands where no side is named."""
    plan = make_plan(["random"], tasks="BinFill", settings=setting, episodes="1", frame="camera")

    assert [job.options.frame for job in plan.jobs()] == [frame]


@pytest.mark.parametrize(
    ("setting", "delivery", "is_same"),
    [("direct", "turns", False), ("explicit", "prompt", True)],
)
def test_an_instruction_in_turns_is_another_episode_unless_it_has_one_utterance(
    setting, delivery, is_same
):
    """Utterances come at once, as a prompt, or one by one. Explicit ones have only one."""
    (at_once,) = make_plan(["random"], settings=setting, delivery="prompt", **ONE_EPISODE).jobs()
    (in_turns,) = make_plan(["random"], settings=setting, delivery="turns", **ONE_EPISODE).jobs()

    assert in_turns.options.delivery == delivery
    assert (identity_key(in_turns) == identity_key(at_once)) == is_same
    assert (in_turns.slug == at_once.slug) == is_same


@pytest.mark.parametrize("text", ["every", "direct, Every", "all,every"])
def test_the_word_every_stands_for_all_settings_and_for_the_harder_ones(text):
    assert make_plan(["random"], settings=text, **ONE_EPISODE).settings == ("every",)


def test_a_setting_in_turns_is_added_to_its_usual_delivery():
    """Three settings of one episode; `in_turns` adds a fourth job, direct in single utterances."""
    plan = make_plan(
        ["random"], tasks="StopCube", episodes="1", settings="explicit,direct,reasoning",
        in_turns="direct",
    )  # fmt: skip

    told = sorted((job.setting, job.options.delivery) for job in plan.jobs())

    assert told == [
        ("direct", "prompt"),
        ("direct", "turns"),
        ("explicit", "prompt"),
        ("reasoning", "prompt"),
    ]


def test_explicit_instructions_in_turns_are_refused():
    """They are one utterance, so that turns would change nothing."""
    with pytest.raises(UnknownNameError, match="no setting in turns 'explicit'"):
        make_plan(["random"], in_turns="explicit")


def test_an_episode_that_lacks_what_a_setting_needs_is_left_out():
    """*direct-rival* needs a second thing that nearly fits the words."""
    plan = make_plan(
        ["random"], tasks="BinFill", settings="explicit,direct-rival", episodes="0-7"
    ).checked()

    episodes = {"explicit": [], "direct-rival": []}
    for job in plan.jobs():
        episodes[job.setting].append(job.episode)
    assert episodes["explicit"] == [0, 1, 2, 3, 4, 5, 6, 7]
    assert 0 < len(episodes["direct-rival"]) < 8


def test_a_plan_whose_setting_fits_none_of_its_episodes_is_refused():
    """*grounded* asks where a thing is, which the scene of this episode does not hide."""
    with pytest.raises(InvalidValueError, match="nothing to play: grounded cannot"):
        make_plan(["random"], settings="grounded", **ONE_EPISODE).checked()


def test_settings_of_a_list_are_played_in_its_order():
    jobs = make_plan(["random"], tasks="BinFill", settings="spatial,direct", episodes="1").jobs()
    assert [job.setting for job in jobs] == ["spatial", "direct"]


@pytest.mark.parametrize(
    ("settings", "rest"), [("explicit,spatial,direct", "explicit,direct"), ("spatial", "all")]
)
def test_a_setting_in_a_list_that_a_task_lacks_is_refused_with_what_plays_the_rest(settings, rest):
    """Of the three tasks only BinFill has the setting spatial.

    `rest` is the list of settings without it, as the message gives it.
    """
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
def test_a_value_that_the_help_of_an_option_names_is_accepted(option, typed):
    """The help of ``--forms`` once said "implicit, resolved or both", and both was refused."""
    assert make_plan(["random"], tasks="PickXtimes", settings="explicit", **{option: typed})


def test_both_forms_are_implicit_and_resolved():
    plan = make_plan(["random"], tasks="PickXtimes", settings="direct", forms="both")
    assert plan.forms == ("implicit", "resolved")


def test_policies_tasks_and_episodes_are_played_in_the_order_in_which_they_are_given():
    """Not in the order of the alphabet or of the numbers."""
    plan = make_plan(
        ["random", "oracle"], tasks="VideoUnmask,BinFill", settings="explicit", episodes="3,0"
    )

    assert [(job.policy, job.task, job.episode) for job in plan.jobs()] == [
        ("random", "VideoUnmask", 3), ("random", "VideoUnmask", 0),
        ("random", "BinFill", 3), ("random", "BinFill", 0),
        ("oracle", "VideoUnmask", 3), ("oracle", "VideoUnmask", 0),
        ("oracle", "BinFill", 3), ("oracle", "BinFill", 0),
    ]  # fmt: skip


def test_plain_words_come_last_in_each_scene():
    """So that no policy hears a scene's goal in plain words before it had to work it out.

    Plain are explicit words, and the *resolved* form, in which references are spelled out.
    """
    plan = make_plan(
        ["random"], tasks="BinFill", settings="explicit,direct", episodes="3,0",
        forms="resolved,implicit",
    )  # fmt: skip

    assert [(job.episode, job.setting, job.form) for job in plan.jobs()] == [
        (3, "direct", "implicit"),
        (3, "explicit", "implicit"),
        (3, "direct", "resolved"),
        (0, "direct", "implicit"),
        (0, "explicit", "implicit"),
        (0, "direct", "resolved"),
    ]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"tasks": "PickXtime"}, r"no task 'PickXtime'.*Did you mean 'PickXtimes'\?"),
        ({"split": "tests"}, r"no split 'tests'.*Did you mean 'test'\?"),
        ({"episodes": "0,50,3"}, r"no episode 50: split 'test' has episodes 0 to 49"),
        ({"video": "on"}, r"video is 'on'; it must be 'off', 'failures' or 'all'"),
        ({"stages": "2,5"}, r"stages \(2, 5\)"),
        ({"frame": "world"}, r"no frame 'world'"),
        ({"settings": "explicit", "delivery": "turn"}, r"no delivery 'turn'.*'turns'"),
        ({"settings": "direct-rivals"}, r"no setting 'direct-rivals'.*'direct-rival'"),
        ({"max_steps": 0}, r"max_steps is 0; it must be a whole number from 1 to 1,000,000,000"),
        ({"tries": 10**22}, r"tries is 10{22}; it must be at most 1000000000"),
        ({"policy_seeds": 10**22}, r"'10{22}' is not a valid policy seed"),
        ({"max_cost": math.inf}, r"max_cost is inf; it must be a finite number"),
        ({"cluster": {"memory_gb": 1e300}}, r"memory_gb is 1e\+300; it must be at most 1000000000"),
        ({"max_steps": True}, r"max_steps is 'True'; it must be a whole number"),
        ({"tasks": None}, r"No task was given"),
        ({"episodes": []}, r"No episode was given"),
        ({"episodes": [True]}, r"'True' is not a valid episode"),
        ({"episodes": 2.0}, r"'2.0' is not a valid episode"),
        ({"max_steps": "many"}, r"max_steps is 'many'"),
        ({"max_cost": "1_0.5"}, r"max_cost is '1_0.5'; write the number without underscores"),
        ({"max_steps": 9, "environment": {"max_steps": 8}},
         r"max_steps is 9, but stands in environment, too"),
    ],
)  # fmt: skip
def test_a_plan_with_an_impossible_option_is_refused_with_the_reason(options, sentence):
    """Each case has one wrong option, and what the message has to say of it."""
    with pytest.raises(InvalidValueError, match=sentence):
        make_plan(["random"], **options)


@pytest.mark.parametrize(
    "name",
    ["tasks", "settings", "in_turns", "forms", "episodes", "policy_seeds", "arms", "stages",
     "devices", "policy_env", "retry_on"],
)  # fmt: skip
def test_a_mapping_where_a_list_belongs_is_refused(name):
    """As a list, its keys would be taken, and its values lost."""
    with pytest.raises(InvalidValueError, match=r"\{'1-5': 3\} is not a valid .*; write a list"):
        make_plan(["random"], **{name: {"1-5": 3}})


@pytest.mark.parametrize(
    ("given", "episodes"),
    [(np.int64(2), (0, 1)), (np.arange(1, 3), (1, 2))],
    ids=["count", "array"],
)
def test_a_plan_takes_numbers_and_arrays_of_numpy(given, episodes):
    plan = make_plan("random", tasks="PickXtimes", settings="explicit", episodes=given)
    assert plan.episodes == episodes


OPTIONS_WITH_NUMBERS = st.dictionaries(
    st.sampled_from([
        "max_steps", "observe_every", "demonstration_frames", "policy_seeds", "tries", "batch",
        "policy_timeout_s", "episode_timeout_s", "max_cost", "devices", "distractors",
    ]),
    st.integers(-(10**25), 10**25) | st.integers(-2, 200) | st.floats() | st.booleans(),
    min_size=1,
    max_size=3,
)  # fmt: skip


@given(OPTIONS_WITH_NUMBERS)
@example({"max_steps": 10**9, "policy_seeds": 10**18 - 1, "max_cost": 1e308})
@settings(deadline=None)
def test_a_plan_with_any_numbers_is_refused_or_read_back_as_it_was_written(numbers):
    """Hypothesis draws options and numbers, from negative to far too large, and what is no number.

    The example is the largest that is allowed, so that at least one plan is stored and read.
    """
    try:
        plan = make_plan("random", tasks="PickXtimes", settings="explicit", episodes=1, **numbers)
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


def test_no_policy_at_all_is_refused():
    with pytest.raises(InvalidValueError, match="No policy was given"):
        parse_policies([])


def test_name_equals_spec_gives_a_policy_a_name():
    spec = "mme-vla://localhost:8001?history=no"

    (policy,) = make_plan([f"pi0.5={spec}"]).policies

    assert (policy.name, policy.spec) == ("pi0.5", spec)


def test_a_name_given_twice_is_refused():
    with pytest.raises(InvalidValueError, match="Two policies are named 'a': oracle and random"):
        make_plan(["a=oracle", "a=random"])


@pytest.mark.parametrize("policy", ["-x=oracle", "=cmd|' /C calc'!A0"])
def test_a_policy_name_that_a_shell_or_a_spreadsheet_would_execute_is_refused(policy):
    with pytest.raises(InvalidValueError, match="name"):
        make_plan(policy, tasks="PickXtimes", episodes="1")


NAMES_THAT_PANDAS_TAKES_FOR_NO_TEXT = (
    "", " ", "NA", "<NA>", "#N/A N/A", "nan", "None", "007", "1,000", ".5", "1e5", "inf", "True",
    "1.#IND",
)  # fmt: skip
"""For a missing value, a number or a truth value."""


@pytest.mark.parametrize("name", NAMES_THAT_PANDAS_TAKES_FOR_NO_TEXT)
def test_a_policy_name_that_pandas_would_read_as_missing_or_a_number_is_refused(name):
    with pytest.raises(InvalidValueError, match=f"Policy '{name}' has no valid name for records"):
        make_plan([replace(read_policy("random"), name=name)], tasks="PickXtimes", episodes="1")


@pytest.mark.parametrize("name", ["NA", "007"])
def test_a_record_whose_policy_name_pandas_would_misread_is_refused(name, tmp_path):
    """Such a record comes from elsewhere, as no plan admits the name."""
    (job,) = make_plan("random", settings="explicit", **ONE_EPISODE).jobs()
    record = msgspec.structs.replace(make_record(job), policy=name)

    with pytest.raises(StoreError, match="a missing value"):
        fill(tmp_path, record)


@pytest.mark.parametrize("name", ["e1", "7b", "na1", "pi0.5", "nan-net", "3d", "1e5x"])
def test_a_policy_name_that_only_resembles_a_number_is_allowed_and_read_back_from_csv(name):
    (policy,) = make_plan([f"{name}=random"], tasks="PickXtimes", episodes="1").policies
    table = io.StringIO(csv_lines([["name"], [policy.name]]))

    assert pd.read_csv(table)["name"].tolist() == [name]


@pytest.mark.parametrize("content", ["{", "words", "[]"])
def test_a_broken_plan_file_in_a_run_is_reported_and_counts_as_no_plan(content, tmp_path, caplog):
    """The message is a warning, so that the results can still be read."""
    (tmp_path / PLAN_FILE).write_text(content)

    assert read_plan(tmp_path) is None
    assert caplog.messages == [
        f"{tmp_path / PLAN_FILE} is not a readable plan, so its missing episodes are not counted."
    ]


def test_a_run_that_has_no_plan_file_is_not_reported(tmp_path, caplog):
    assert read_plan(tmp_path) is None
    assert caplog.messages == []


def test_a_setting_named_next_to_all_is_added_for_the_tasks_that_have_it():
    """*grounded* asks where a thing is; StopCube has no such setting, and VideoUnmask has."""
    plan = make_plan(
        ["random"], tasks="StopCube,VideoUnmask", settings="grounded,All", episodes="1"
    )

    settings_of = {"StopCube": set(), "VideoUnmask": set()}
    for job in plan.jobs():
        settings_of[job.task].add(job.options.setting)
    assert plan.setting_names == (*plain_settings(), "grounded")
    assert settings_of["StopCube"] == {"explicit", "direct", "reasoning", "contextual"}
    assert "grounded" in settings_of["VideoUnmask"]
