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
    """A point has two numbers from 0 to 1000: here one is missing, is no number, or is 1001.

    The others have no words, one letter more than a subgoal may have, or a character that is no
    text.
    """
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
    """Steps that follow each other by at most `gap` form a chain, and only its middle one is kept.

    5 and 8 are 3 apart: with a gap of 2 both are kept. Of the two of 5, 6 the later counts as the
    middle. The last row is sorted first: 5, 7, 9 is a chain with the middle 7.
    """
    assert merge_keyframes(steps, gap) == kept


def test_the_list_of_subgoal_forms_for_planners_covers_all_tasks_and_nothing_else():
    """Planners are told all forms of subgoals, such as *pick up the {color} cube [at]*.

    Each subgoal of 40 episodes of every task, with and without a point, fits one of the forms; and
    each form is used by some task. No subgoal reads like *all is done*, at which planners stop.
    """
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
    """Of `length` frames, numbered from 0, at most `most` are kept: `kept` are their numbers.

    The first one is always kept, and with two or more also the last one.
    """
    frames = np.arange(length)[:, None, None, None]

    assert sample_evenly(frames, most).ravel().tolist() == kept


def test_a_clip_of_sampled_frames_lasts_as_long_as_the_video():
    """Of 10 frames, 30 a second, 4 are kept: 12 a second make the same third of a second."""
    frames = np.zeros((10, 8, 8, 3), np.uint8)

    assert summary_clip(frames, 4, 10).rate == 12


def test_a_contact_sheet_shows_frames_in_reading_order_each_with_its_label():
    """Five frames of one shade each, 10 to 50, are shrunk to tiles of 64 pixels, four in a row.

    The lowest right pixel of each tile (row and column 63, 127 …) shows its frame's shade. Only
    the second frame has a label, "x", so the first tile has one shade all over, and the second has
    more.
    """
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
    """`a` is the field of the reply; the values are no text, or a text without a word."""
    with pytest.raises(UnparsableReplyError, match="'a' has to hold words"):
        text_of({"a": value}, "a")


def test_each_of_our_prompt_files_has_a_fingerprint_of_its_own():
    """Records tell by the fingerprint which file a model was prompted with."""
    fingerprints = {load_prompts(name).fingerprint for name in PROMPTS}

    assert len(fingerprints) == len(PROMPTS)


@pytest.fixture
def prompts_of_a_user(tmp_path):
    """Prompts with two of the texts that a planner needs; one has a field that does not exist."""
    file = tmp_path / "mine.toml"
    file.write_text('again = "no: $why"\nsystem = "x $missing"\n')
    return load_prompts("qwen", str(file))


def test_a_user_s_prompt_file_replaces_ours_and_has_another_fingerprint(prompts_of_a_user):
    """The user's file of the fixture says for *again*: `no: $why`."""
    assert prompts_of_a_user.fill("again", why="so") == "no: so"
    assert prompts_of_a_user.fingerprint != load_prompts("qwen").fingerprint


@pytest.mark.parametrize(
    ("name", "reason"), [("goal", "'goal'"), ("system", r"'system' .*missing.*\$why")]
)
def test_a_prompt_that_a_user_s_file_lacks_or_that_cannot_be_filled_is_refused(
    prompts_of_a_user, name, reason
):
    """The file of the fixture has no text `goal`; its text `system` has a field `$missing`.

    Only `$why` can be filled, so the error names the text and what it may have.
    """
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
    """A video of 10 steps has the pictures of every second one: 0, 2, 4, 6 and 8.

    Who wants all gets these; who wants every 4th or 6th step gets those of them. Fields without
    pictures, such as joint positions, keep all 10 steps.
    """
    video = {"joint_positions": np.arange(10), "front_rgb": np.arange(0, 10, 2)}

    part = DemonstrationSubset(video, 2, wanted)

    assert part["front_rgb"].tolist() == seen
    assert len(part["joint_positions"]) == 10


@pytest.mark.parametrize(
    ("planner", "policy", "every"), [(None, 3, 3), (2, 3, 1), (4, 6, 2), (None, None, None)]
)
def test_observations_come_as_often_as_planner_and_policy_need_together(planner, policy, every):
    """Of a planner and a policy, each wants a history of every so many steps, or none (None).

    Together they need the greatest common divisor: every 2nd and 3rd step are both among all
    steps.
    """
    assert merge_observe_every(planner, policy) == every
    assert merge_observe_every(policy, planner) == every


@pytest.mark.parametrize(
    ("wanted", "seen"), [(2, {"history": (6, 8, 10)}), (4, {"history": (8,)}), (None, {})]
)
def test_each_sees_its_own_part_of_the_history(wanted, seen):
    """The chunk has observations of steps 6, 8 and 10, every second step.

    Two came in an earlier chunk, those of steps 2 and 4. Who wants every 4th step gets only 8, as
    4, 8, 12 … are the multiples of 4; who wants none gets no history at all.
    """
    observation = {"now": 10, "history": (6, 8, 10)}

    found = select_history(observation, earlier=2, every=2, wanted=wanted)

    assert found == {"now": 10, **seen}
