"""Points, key frames, forms of subgoals, pictures and merged requirements, without a model."""

import os
import re

import numpy as np
import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_needs import (
    merge_demonstration_frames,
    merge_observe_every,
)
from roboirg.core.subgoal_text import MOST_SUBGOAL_LETTERS
from roboirg.policies.planners.model_planners import merge_keyframes
from roboirg.policies.planners.observation_merging import (
    DemonstrationSubset,
    select_history,
)
from roboirg.policies.planners.points import (
    parse_points,
    says_finished,
    to_pixel,
)
from roboirg.policies.vlm.model_content import summary_clip
from roboirg.policies.vlm.prompt_files import load_prompts
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.media import contact_sheets, sample_evenly
from roboirg.util.reply_reading import UnparsableReplyError, text_of

PROMPTS = ("listener", "qwen", "gemini", "memer", "subgoals")


@pytest.mark.parametrize(
    ("reply", "subgoal"),
    [
        ("Go at <500, 250>", "go at <128, 64>"),
        ("Go at <|box_start|>(500,250)<|box_end|><|im_end|>", "go at <128, 64>"),
        ('"Go\nat (500, 250) and at (0, 1000)."', "go at <128, 64> and at <0, 255>"),
        ("Go left", "go left"),
    ],
    ids=["angle brackets", "box tags", "two points in parentheses", "no point"],
)
def test_points_in_thousandths_are_converted_to_pixels_of_a_picture_of_256(reply, subgoal):
    """The row stands first: 500 of 1000 is row 128, 250 of 1000 is column 64."""
    assert parse_points(reply) == subgoal


@pytest.mark.parametrize(
    ("thousandths", "pixel"), [(0, 0), (3, 0), (4, 1), (500, 128), (999, 255), (1000, 255)]
)
def test_thousandths_become_pixels_rounded_down_and_within_the_picture(thousandths, pixel):
    """A picture has 256 pixels, from 0 to 255; 4 thousandths are 1.02 pixels."""
    assert to_pixel(thousandths) == pixel


@pytest.mark.parametrize(
    "text",
    [
        *("", "  \n", "go at <1001, 3>", "go at <3>", "go at <|box_start|>(3)<|box_end|>", "{}"),
        *("<y, x>", "x" * (MOST_SUBGOAL_LETTERS + 1), "go at (1001,3)", "go \ud800"),
    ],
)
def test_subgoals_with_a_broken_point_or_too_many_letters_are_refused(text):
    with pytest.raises(UnparsableReplyError):
        parse_points(text)


@pytest.mark.parametrize(
    ("steps", "gap", "kept"),
    [
        ([], 3, ()),
        ([5, 8], 2, (5, 8)),
        ([5, 6, 7], 1, (6,)),
        ([5, 6], 1, (6,)),
        ([40, 9, 5, 7, 20], 2, (7, 20, 40)),
    ],
    ids=["none", "apart", "middle of three", "later of two", "in any order"],
)
def test_key_frames_closer_than_a_gap_are_merged_into_one(steps, gap, kept):
    """Of a chain of steps, each at most a gap after the one before, the middle one is kept."""
    assert merge_keyframes(steps, gap) == kept


def test_the_list_of_subgoal_forms_for_planners_covers_all_tasks_and_nothing_else():
    forms = load_prompts("subgoals").lines("forms")
    patterns = [_pattern(form) for form in forms]
    used = set()

    for task in every_task():
        for index in range(40):
            for stage in get_episode(task, "train", index).stages:
                for at in ("at <3, 200>", ""):
                    text = " ".join(stage.subgoal.replace("{at}", at).split())
                    found = {n for n, pattern in enumerate(patterns) if pattern.fullmatch(text)}
                    assert found, text
                    used |= found
                    assert not says_finished(text)

    assert used == set(range(len(forms))), "a form that no task has"


def _pattern(form):
    parts = re.split(r"(\{[^}]*\}| ?\[at\])", form)
    return re.compile(
        "".join(
            "(" + part[1:-1] + ")" if part.startswith("{")
            else r"( at <\d+, \d+>)?" if part.endswith("[at]")
            else re.escape(part)
            for part in parts
        )
    )  # fmt: skip


@pytest.mark.parametrize(
    ("length", "most", "kept"),
    [(3, 5, [0, 1, 2]), (10, 4, [0, 3, 6, 9]), (9, 1, [0]), (7, 3, [0, 3, 6])],
)
def test_frames_sampled_from_a_video_are_spread_evenly_with_both_ends(length, most, kept):
    """At most `most` of `length` frames are kept."""
    frames = np.arange(length)[:, None, None, None]

    assert sample_evenly(frames, most).ravel().tolist() == kept


def test_a_clip_of_sampled_frames_lasts_as_long_as_the_video():
    """Of 10 frames, 30 a second, 4 are kept: 12 a second make the same third of a second."""
    frames = np.zeros((10, 8, 8, 3), np.uint8)

    assert summary_clip(frames, 4, 10).rate == 12


def test_a_contact_sheet_shows_frames_in_reading_order_each_with_its_label():
    """Tiles have 64 pixels, four in a row; the second of five frames has the label "x"."""
    shades = [10, 20, 30, 40, 50]
    frames = np.stack([np.full((128, 128, 3), shade, np.uint8) for shade in shades])

    (sheet,) = contact_sheets(frames, ["", "x", "", "", ""])

    corners = sheet[63::64, 63::64, 0]
    assert corners[0].tolist() == [10, 20, 30, 40]
    assert corners[1, 0] == 50
    assert np.ptp(sheet[:64, :64]) == 0
    assert np.ptp(sheet[:64, 64:128]) > 0


@pytest.mark.parametrize("value", [None, 3, "", " ", ["x"]])
def test_a_reply_field_that_must_hold_words_is_refused_without_any(value):
    with pytest.raises(UnparsableReplyError, match="'a' has to hold words"):
        text_of({"a": value}, "a")


def test_each_of_our_prompt_files_has_a_fingerprint_of_its_own():
    fingerprints = {load_prompts(name).fingerprint for name in PROMPTS}

    assert len(fingerprints) == len(PROMPTS)


@pytest.fixture
def prompts_of_a_user(tmp_path):
    """Prompts with two of the texts that a planner needs; one has a field that does not exist."""
    file = tmp_path / "mine.toml"
    file.write_text('again = "no: $why"\nsystem = "x $missing"\n')
    return load_prompts("qwen", str(file))


def test_a_user_s_prompt_file_replaces_ours_and_has_another_fingerprint(prompts_of_a_user):
    assert prompts_of_a_user.fill("again", why="so") == "no: so"
    assert prompts_of_a_user.fingerprint != load_prompts("qwen").fingerprint


@pytest.mark.parametrize(
    ("name", "reason"), [("goal", "'goal'"), ("system", r"'system' .*missing.*\$why")]
)
def test_a_prompt_that_a_user_s_file_lacks_or_that_cannot_be_filled_is_refused(
    prompts_of_a_user, name, reason
):
    with pytest.raises(InvalidValueError, match=reason):
        prompts_of_a_user.fill(name, why="so")


def test_a_prompt_file_that_is_no_toml_is_refused(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("= 3")

    with pytest.raises(InvalidValueError, match="not TOML"):
        load_prompts("qwen", str(file))


def test_prompts_that_are_a_pipe_are_refused(tmp_path):
    """To open it would wait for ever."""
    os.mkfifo(tmp_path / "pipe.toml")

    with pytest.raises(InvalidValueError, match=r"pipe\.toml' cannot be read .*not a regular file"):
        load_prompts("qwen", str(tmp_path / "pipe.toml"))


@pytest.mark.parametrize(
    ("planner", "policy", "drawn"),
    [("all", 3, "all"), ("none", 5, 5), (4, 6, 2), (5, 7, "all"), ("none", "none", "none")],
)
def test_the_video_has_the_frames_that_planner_and_policy_need_together(planner, policy, drawn):
    """Every 4th and every 6th frame are both among every 2nd; every 5th and 7th need all."""
    assert merge_demonstration_frames(planner, policy) == drawn
    assert merge_demonstration_frames(policy, planner) == drawn


@pytest.mark.parametrize(
    ("wanted", "seen"), [("all", [0, 2, 4, 6, 8]), (4, [0, 4, 8]), (6, [0, 6])]
)
def test_each_sees_its_own_part_of_the_frames_of_a_video(wanted, seen):
    """Of 10 steps every 2nd was drawn; fields without pictures keep all steps."""
    video = {"joint_positions": np.arange(10), "front_rgb": np.arange(0, 10, 2)}

    part = DemonstrationSubset(video, 2, wanted)

    assert part["front_rgb"].tolist() == seen
    assert len(part["joint_positions"]) == 10


@pytest.mark.parametrize(
    ("planner", "policy", "every"), [(None, 3, 3), (2, 3, 1), (4, 6, 2), (None, None, None)]
)
def test_observations_come_as_often_as_planner_and_policy_need_together(planner, policy, every):
    assert merge_observe_every(planner, policy) == every
    assert merge_observe_every(policy, planner) == every


@pytest.mark.parametrize(
    ("wanted", "seen"), [(2, {"history": (6, 8, 10)}), (4, {"history": (8,)}), (None, {})]
)
def test_each_sees_its_own_part_of_the_history(wanted, seen):
    """Observations of steps 6, 8 and 10 follow the two of an earlier chunk, of steps 2 and 4."""
    observation = {"now": 10, "history": (6, 8, 10)}

    found = select_history(observation, earlier=2, every=2, wanted=wanted)

    assert found == {"now": 10, **seen}
