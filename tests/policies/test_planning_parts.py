"""Points, key frames, forms of subgoals, pictures and merged requirements, without a model."""

import itertools
import math
import os
import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import PICTURE_SIZE
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

thousandths = st.integers(0, 1000)
PROMPTS = ("listener", "qwen", "gemini", "memer", "subgoals")


@pytest.mark.parametrize(
    ("point", "reply"),
    [
        ("at <{}, {}>", "Go {}"),
        ("at <|box_start|>({},{})<|box_end|>", "Go {}<|im_end|>"),
        ("at ({}, {})", '"Go\n{}."'),
    ],
)
@given(st.lists(st.tuples(thousandths, thousandths), max_size=5))
def test_points_in_thousandths_are_converted_to_pixels_with_the_row_first(point, reply, points):
    """One pass: what is a pixel already is not taken for a thousandth again."""
    said = " and ".join(point.format(y, x) for y, x in points)
    expected = " and ".join(f"at <{to_pixel(y)}, {to_pixel(x)}>" for y, x in points)
    assert parse_points(reply.format(said)) == f"go {expected}".strip()


@given(thousandths)
def test_thousandths_become_pixels_rounded_down_and_within_the_picture(value):
    assert to_pixel(value) == min(int(Fraction(PICTURE_SIZE * value, 1000)), PICTURE_SIZE - 1)


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


@given(st.lists(st.integers(0, 200)), st.integers(0, 20))
def test_key_frames_closer_than_a_gap_are_merged_into_one(steps, near):
    """A chain is a series of steps, each at most `near` after the one before; one of it is kept."""
    kept = merge_keyframes(steps, near)

    assert set(kept) <= set(steps)
    assert kept == tuple(sorted(kept))
    assert merge_keyframes(reversed(steps), near) == kept == merge_keyframes(kept, near)
    assert all(later - sooner > near for sooner, later in itertools.pairwise(kept))
    chains = 0
    end = -math.inf
    for step in sorted(steps):
        chains += step - end > near
        end = step
    assert len(kept) == chains


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


@given(st.integers(1, 60), st.integers(1, 12))
def test_frames_sampled_from_a_video_are_spread_evenly_with_both_ends(length, most):
    frames = np.arange(length, dtype=np.uint8)[:, None, None, None]
    kept = sample_evenly(frames, most).ravel().tolist()
    assert len(kept) == min(length, most)
    assert kept[0] == 0
    if len(kept) > 1:
        assert kept[-1] == length - 1
        gaps = np.diff(kept)
        assert max(1, gaps.max() - 1) <= gaps.min()

    clip = summary_clip(frames, most, length)
    assert len(kept) / clip.rate == Fraction(length, 30)


def test_a_contact_sheet_shows_frames_in_reading_order_each_with_its_label():
    """18 frames of different shades on sheets of four by four; one has the label "x"."""
    shades = [10 * number for number in range(18)]
    frames = [np.full((128, 128, 3), shade, np.uint8) for shade in shades]
    labels = ["x" if shade == 50 else "" for shade in shades]

    found = []
    for sheet in contact_sheets(np.stack(frames), labels):
        for row, column in itertools.product(range(0, len(sheet), 64), range(0, 256, 64)):
            tile = sheet[row : row + 64, column : column + 64]
            found.append((int(tile[-1, -1, 0]), bool(np.ptp(tile))))

    assert found == [(shade, shade == 50) for shade in (*shades, 0, 0)]


@pytest.mark.parametrize("value", [None, 3, "", " ", ["x"]])
def test_a_reply_field_that_must_hold_words_is_refused_without_any(value):
    with pytest.raises(UnparsableReplyError, match="'a' has to hold words"):
        text_of({"a": value}, "a")


def test_a_user_s_prompt_file_replaces_ours_and_has_another_fingerprint(tmp_path):
    assert len({load_prompts(name).fingerprint for name in PROMPTS}) == len(PROMPTS)

    file = tmp_path / "mine.toml"
    file.write_text('again = "no: $why"\nsystem = "x $missing"\n')
    mine = load_prompts("qwen", str(file))
    assert mine.fill("again", why="so") == "no: so"
    assert mine.fingerprint != load_prompts("qwen").fingerprint
    with pytest.raises(InvalidValueError, match=r"'goal'"):
        mine.fill("goal", instruction="x")
    with pytest.raises(InvalidValueError, match=r"'system' .*missing.*\$why"):
        mine.fill("system", why="so")

    file.write_text("= 3")
    with pytest.raises(InvalidValueError, match="not TOML"):
        load_prompts("qwen", str(file))


def test_prompts_that_are_a_pipe_are_refused(tmp_path):
    """To open it would wait for ever."""
    os.mkfifo(tmp_path / "pipe.toml")

    with pytest.raises(InvalidValueError, match=r"pipe\.toml' cannot be read .*not a regular file"):
        load_prompts("qwen", str(tmp_path / "pipe.toml"))


wishes = st.sampled_from(["all", "none"]) | st.integers(1, 12)


@given(wishes, wishes, st.integers(0, 40))
def test_planner_and_policy_each_get_the_video_frames_that_they_asked_for(one, other, steps):
    """The environment draws frames for both wishes; each then sees its own part."""
    drawn = merge_demonstration_frames(one, other)
    assert drawn == merge_demonstration_frames(other, one)

    every = {"all": 1}.get(drawn, drawn)
    shown = {"joint_positions": np.arange(steps)}
    if drawn != "none":
        shown["front_rgb"] = np.arange(steps)[::every]
    excerpt = DemonstrationSubset(shown, drawn, one)

    assert dict(excerpt).keys() == shown.keys()
    assert len(excerpt["joint_positions"]) == steps
    if one != "none":
        stride = {"all": 1}.get(one, one)
        assert excerpt["front_rgb"].tolist() == list(range(0, steps, stride))


@given(
    st.none() | st.integers(1, 6),
    st.none() | st.integers(1, 6),
    st.lists(st.integers(1, 20), max_size=6),
)
def test_planner_and_policy_each_get_the_observations_of_their_own_period(one, other, chunks):
    every = merge_observe_every(one, other)
    assert every == merge_observe_every(other, one)

    step = looked = 0
    seen = []
    for chunk in chunks:
        observation = {"now": step + chunk}
        if every is not None:
            looks = range(step + 1, step + chunk + 1)
            observation["history"] = tuple(at for at in looks if at % every == 0)
        step += chunk
        cut = select_history(observation, looked, every, one)
        assert cut["now"] == step
        assert ("history" in cut) == (one is not None)
        seen += cut.get("history", ())
        looked += len(observation.get("history", ()))
    assert seen == ([] if one is None else list(range(one, step + 1, one)))
