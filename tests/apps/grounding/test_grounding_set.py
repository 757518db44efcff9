"""The grounding dataset: what interpreter and scene say, and pictures that show it."""

import itertools
import json
from collections import Counter
from dataclasses import replace

import av
import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_items import SETTINGS, items_of
from typer.testing import CliRunner

from roboirg.apps.grounding import dataset_export
from roboirg.apps.grounding.dataset_export import CARD, export_grounding
from roboirg.apps.grounding.items.grounding_item import (
    LETTERS,
    decode_mask,
    encode_mask,
    read_items,
)
from roboirg.apps.grounding.items.item_builder import (
    item_id,
    wanted_options,
)
from roboirg.apps.grounding.items.media_store import nearest_to_center
from roboirg.apps.grounding.items.question_set import ExportRequest
from roboirg.apps.grounding.items.referents import find_referents, pointed_kinds
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.version import __version__
from roboirg.envs.environment import RoboIRGEnv
from roboirg.language import FORMS, instruct_with
from roboirg.language.settings import all_settings
from roboirg.main import app
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.prompt_files import load_prompts
from roboirg.reader import interpret
from roboirg.shortcuts.command_chance import goals_of_command, understood_goals
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.splits.splits import SIZES, get_episode
from roboirg.util.media import CONTROL_RATE

BENCHMARK = [name for name, task in all_tasks().items() if task.suite != "real"]
SEEN = [
    ("PickXtimes", 3),
    ("BinFill", 3),
    ("ButtonUnmaskSwap", 0),
    ("StopCube", 0),
    ("VideoUnmask", 1),
]
"""Without and with a video; hidden things, things that come later, amounts."""
SHOWN = (
    "id", "text", "stages", "wordings", "choices", "choice", "answers", "command_chance",
    "hidden_slots", "pattern", "expressions", "points_question",
)  # fmt: skip
"""Fields of an item that are compared as they are."""


def said_of(item, episode):
    said = instruct_with(episode, item.options)
    assert said.text == item.text
    return said


@pytest.mark.parametrize("task", BENCHMARK)
def test_answers_are_what_the_words_mean_in_the_scene(task):
    schema = goal_schema(task)
    for index in range(2):
        is_first = index == 0
        episode, items = items_of(task, index, forms=FORMS, every_variant=is_first)
        for item in items:
            goals = understood_goals(said_of(item, episode), episode)
            assert [schema.answers[goal] for goal in goals] == item.answers
            assert item.answer in item.answers
            assert item.answer in item.goals
            assert len(set(item.goals)) == len(item.goals)
            assert set(item.goals) == {
                schema.answers[goal] for goal in get_task(task).goals(episode.scene)
            }


@pytest.mark.parametrize("task", BENCHMARK)
def test_choices_are_goals_of_the_scene_in_other_words_and_one_is_right(task):
    schema = goal_schema(task)
    for index in range(1, 5):
        episode, items = items_of(task, index)
        for item in items:
            assert 2 <= len(item.choices) == len(set(item.choices)) <= 4
            assert item.choice_answers[LETTERS.index(item.choice)] == item.answer
            assert item.choice_answers.count(item.answer) == 1
            for command, answer in zip(item.choices, item.choice_answers, strict=True):
                (goal,) = interpret(command, episode.scene, task).goals
                assert schema.answers[goal] == answer
                assert command not in item.text


def test_who_hears_the_command_alone_can_only_guess_among_the_choices():
    for task, index in itertools.product(BENCHMARK, range(1, 3)):
        episode, items = items_of(task, index)
        for item in (item for item in items if item.command_chance < 1):
            fitting = goals_of_command(said_of(item, episode), episode)
            answers = [goal_schema(task).answers[goal] for goal in fitting]
            assert set(item.choice_answers) <= set(answers), item.text


def test_items_are_as_stored(snapshot):
    """Choices, hidden slots, expressions and questions, of amounts, of two things and of one."""
    lines = []
    for task, index in SEEN[1:]:
        _, items = items_of(task, index, forms=FORMS)
        for item in items:
            lines.append(json.dumps([getattr(item, name) for name in SHOWN]))

    assert "\n".join(lines) == snapshot


def test_places_of_the_right_choice_are_balanced():
    places = Counter(
        (item.setting, item.choice)
        for index in range(48)
        for item in items_of("StopCube", index)[1]
        if item.setting != "reasoning"  # which leaves three goals in some scenes
    )
    assert set(places.values()) == {12}
    assert len(places) == 3 * 4


def test_ids_are_unique_and_the_same_whatever_the_answer():
    found = [
        item.id
        for task in BENCHMARK
        for item in items_of(task, 1, forms=FORMS, every_variant=True)[1]
    ]
    assert len(set(found)) == len(found)

    episode = get_episode("PickXtimes", "test", 3)
    options = InstructionOptions("direct")
    name = item_id(episode, options)
    others = get_task("PickXtimes").goals(episode.scene)

    assert {item_id(replace(episode, goal=goal), options) for goal in others} == {name}
    assert item_id(get_episode("PickXtimes", "val", 3), options) != name


def test_the_test_split_has_2550_items():
    counts = Counter(
        options.setting
        for task in BENCHMARK
        for index in range(SIZES["test"])
        for options in wanted_options(
            get_episode(task, "test", index),
            SETTINGS,
            ("implicit",),
            InstructionOptions(),
            every_variant=False,
        )
    )
    spatial = sum(get_task(task).spatial for task in BENCHMARK)

    assert counts["spatial"] == 50 * spatial
    assert counts.total() == 50 * (4 * len(BENCHMARK) + spatial) == 2550


def test_options_that_a_setting_does_not_read_keep_their_defaults():
    episode = get_episode("PickXtimes", "test", 3)
    changed = InstructionOptions(delivery="turns", stages=(1, 5), frame="camera", wordings="train")
    for options in wanted_options(episode, SETTINGS, FORMS, changed, every_variant=True):
        reads = all_settings()[options.setting].reads
        assert options.wordings == "train"
        for name in ("delivery", "stages", "frame"):
            value = getattr(options, name)
            assert value == getattr(InstructionOptions(), name) or name in reads


@settings(max_examples=30)
@given(st.data())
def test_masks_survive_their_run_lengths(data):
    height = data.draw(st.integers(1, 9))
    width = data.draw(st.integers(1, 9))
    bits = data.draw(st.lists(st.booleans(), min_size=height * width, max_size=height * width))
    mask = np.array(bits).reshape(height, width)

    counts = encode_mask(mask)

    assert all(counts[1:])
    assert (decode_mask(counts, mask.shape) == mask).all()
    if mask.any():
        assert mask[nearest_to_center(mask)]


def test_runs_that_do_not_fill_the_picture_are_refused():
    with pytest.raises(InvalidValueError, match="cover 3 pixels; they must cover 2 x 2"):
        decode_mask([1, 2], (2, 2))


def test_run_lengths_go_down_the_columns():
    mask = np.array([[False, True], [True, True]])
    assert encode_mask(mask) == [1, 3]


@pytest.mark.parametrize(
    ("task", "kinds"),
    [
        ("PickXtimes", ("cube",)),
        ("StopCube", ("target",)),
        ("VideoUnmaskSwap", ("container",)),
        ("VideoPlaceButton", ("cube", "target")),
        ("PutInBox", ("box",)),
        ("PickByCount", ("tape",)),
    ],
)
def test_things_to_point_at_are_those_that_the_words_tell_apart(task, kinds):
    assert pointed_kinds(task) == kinds


def test_what_is_not_there_yet_is_pointed_at_by_what_is_in_its_place():
    episode = get_episode("ButtonUnmask", "test", 0)
    (referent,) = find_referents(episode)
    assert episode.scene[referent.objects[0]].color == episode.goal.texts("colors")[0]
    assert referent.kind == "hidden_cube"

    episode = get_episode("VideoUnmask", "test", 0)
    (referent,) = find_referents(episode)
    inside = episode.scene.hidden_in(referent.objects[0])
    assert inside.color == episode.goal.texts("colors")[0]


def test_of_an_amount_every_thing_of_the_color_will_do():
    episodes = (get_episode("BinFill", "test", index) for index in range(50))
    episode = next(drawn for drawn in episodes if len(drawn.goal.texts("colors")) > 1)
    for referent in find_referents(episode):
        (color,) = {episode.scene[name].color for name in referent.objects}
        alike = [cube for cube in episode.scene.of_kind("cube") if cube.color == color]
        assert len(alike) == len(referent.objects)


def test_the_question_is_the_listener_s_and_the_others_share_its_beginning():
    own = load_prompts("grounding_questions")
    listener = load_prompts("listener")
    assert listener.fill("system").startswith(own.fill("system"))

    _, items = items_of("PickXtimes", 0)
    for item in items:
        assert item.text in item.said
        for line in (
            f"{letter}. {choice}" for letter, choice in zip(LETTERS, item.choices, strict=False)
        ):
            assert line in item.choice_question


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grounding") / "set"
    request = ExportRequest(
        tuple((task, "test", index) for task, index in SEEN),
        SETTINGS,
        ("implicit",),
        frames=4,
        frames_every=16,
    )
    return request, folder, export_grounding(request, folder, 0)


@pytest.mark.sim
@pytest.mark.parametrize(("task", "index"), SEEN)
def test_pixels_lie_in_masks_of_the_right_things(exported, task, index):
    """The right place is computed from poses and the camera, not from the segmentation."""
    _, folder, _ = exported
    items = {item.task: item for item in read_items(folder) if item.setting == "direct"}
    points = items[task].points
    episode = get_episode(task, "test", index)
    env = RoboIRGEnv(episode, cameras=("front",), calibration=True, demonstration_frames="none")
    observation, _ = env.reset()

    for point, referent in zip(points, find_referents(episode), strict=True):
        mask = point.mask
        assert mask[point.y, point.x]
        places = [
            project(observation, env.session.world.bodies[name].position)
            for name in referent.objects
        ]
        assert any(
            mask[max(0, row - 9) : row + 10, max(0, column - 9) : column + 10].any()
            for column, row in places
        )
        if len(places) == 1:
            ((column, row),) = places
            rows, columns = np.nonzero(mask)
            assert np.hypot(rows.mean() - row, columns.mean() - column) < 12


def project(observation, position):
    """Column and row of a point of the world in the front picture."""
    place = observation["front_extrinsic"] @ np.append(position, 1.0)
    x, y, depth = observation["front_intrinsic"] @ place
    return round(x / depth), round(y / depth)


@pytest.mark.sim
def test_pictures_are_stored_once_and_all_are_there(exported):
    _, folder, facts = exported
    paths = set()
    for item in read_items(folder):
        paths |= {item.picture, *item.frames}

    assert facts.pictures == len(paths) == len(list((folder / "pictures").iterdir()))
    assert all((folder / path).is_file() for path in paths)


@pytest.mark.sim
def test_tasks_with_a_video_have_its_film_and_some_frames(exported):
    request, folder, _ = exported
    items = read_items(folder)

    (video,) = [item for item in items if item.task == "VideoUnmask" and item.setting == "direct"]
    assert (folder / video.video).read_bytes()[4:8] == b"ftyp"
    with av.open(str(folder / video.video)) as film:  # as fast as it was
        assert film.streams.video[0].average_rate * request.frames_every == CONTROL_RATE
    assert len(video.frames) == 4
    assert all(item.video is None for item in items if not item.task.startswith("Video"))


@pytest.mark.sim
def test_the_table_has_every_item_with_its_pictures(exported):
    parquet = pytest.importorskip("pyarrow.parquet")
    _, folder, facts = exported
    items = read_items(folder)

    table = parquet.read_table(folder / "data" / "test-00000-of-00001.parquet")

    columns = json.loads(table.schema.metadata[b"huggingface"])["info"]["features"]
    assert columns["picture"] == {"_type": "Image"}
    assert columns["frames"]["feature"] == {"_type": "Image"}
    rows = table.to_pylist()
    assert len(rows) == facts.items
    for row, item in zip(rows, items, strict=True):
        assert (row["id"], row["choices"]) == (item.id, item.choices)
        for picture in (row["picture"], *row["frames"]):
            assert picture["bytes"] == (folder / picture["path"]).read_bytes()


def test_the_card_says_what_the_dataset_holds(tmp_path, monkeypatch, snapshot):
    items = [
        msgspec.structs.replace(item, video=f"{task}.mp4" if task == "StopCube" else None)
        for task, split in (("StopCube", "val"), ("BinFill", "test"))
        for item in items_of(task, 1, every_variant=task == "BinFill", split=split)[1]
    ]
    (tmp_path / "large").write_bytes(bytes(3 << 20))
    monkeypatch.setattr(dataset_export, "collect_items", lambda *_: items)
    monkeypatch.setattr(dataset_export, "write_parquet", lambda *_: None)
    request = ExportRequest((), (), (), frames=8, frames_every=16)
    digest = export_grounding(request, tmp_path, 0).sha256

    card = (tmp_path / CARD).read_text().replace(digest, "SHA-256")

    assert card.replace(__version__, "VERSION") == snapshot


def test_a_setting_that_a_task_lacks_is_refused(tmp_path):
    words = ["--tasks", "StopCube", "--settings", "spatial", "--out", str(tmp_path / "set")]
    with pytest.raises(InvalidValueError, match="no spatial setting in StopCube"):
        CliRunner().invoke(app, ["export", "grounding", *words], catch_exceptions=False)


def test_a_folder_of_something_else_is_not_touched(tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    request = ExportRequest((("StopCube", "test", 0),), ("explicit",), ("implicit",))
    with pytest.raises(InvalidValueError, match="not an empty folder"):
        export_grounding(request, tmp_path, 0)
