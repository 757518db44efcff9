"""The grounding dataset: what interpreter and scene say, and pictures that show it."""

import json
from collections import Counter
from dataclasses import replace

import av
import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import array_shapes, arrays
from made_items import SETTINGS, items_of

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
from roboirg.policies.vlm.goal_schema import goal_schema
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


def said_of(item, episode):
    """Return the instruction of an item."""
    return instruct_with(episode, item.options)


@pytest.mark.parametrize("task", BENCHMARK)
def test_answers_are_what_the_words_mean_in_the_scene(task):
    """An item is a question about an instruction: which goal of the scene does it mean? An answer
    is a goal as JSON, such as {"color": "red"}.

    Here are all items of a test episode, in every setting and form. Their stored answers are those
    of the goals that the interpreter of instructions understands.
    """
    answer_of = goal_schema(task).answers
    episode, items = items_of(task, 0, forms=FORMS, every_variant=True)

    for item in items:
        understood = understood_goals(said_of(item, episode), episode)
        assert item.answers == [answer_of[goal] for goal in understood], item.text
        assert item.answer in item.answers


@pytest.mark.parametrize("task", BENCHMARK)
def test_an_item_names_each_goal_of_its_scene_once(task):
    """Such as picking up each of three cubes from one to five times."""
    answer_of = goal_schema(task).answers
    episode, items = items_of(task, 0, forms=FORMS, every_variant=True)

    goals_of_scene = sorted(answer_of[goal] for goal in get_task(task).goals(episode.scene))

    for item in items:
        assert sorted(item.goals) == goals_of_scene


@pytest.mark.parametrize("task", BENCHMARK)
def test_choices_are_goals_of_the_scene_in_other_words_and_one_is_right(task):
    """Each is a command that means one goal, and is not itself in the instruction."""
    answers = goal_schema(task).answers
    for index in range(1, 5):
        episode, items = items_of(task, index)
        for item in items:
            assert 2 <= len(item.choices) == len(set(item.choices)) <= 4
            assert item.choice_answers.count(item.answer) == 1
            assert item.choice_answers[LETTERS.index(item.choice)] == item.answer
            for command, answer in zip(item.choices, item.choice_answers, strict=True):
                (goal,) = interpret(command, episode.scene, task).goals
                assert answers[goal] == answer, command
                assert command not in item.text


@pytest.mark.parametrize("task", BENCHMARK)
def test_who_hears_the_command_alone_can_only_guess_among_the_choices(task):
    """The command is the last utterance, such as "Grab it": without those before it, several goals
    of the scene fit. `command_chance` is how often a guess among them is right.

    Where it is below 1, each choice of the question fits the command, so that the choices do not
    tell which of the goals is meant.
    """
    episode, items = items_of(task, 1)

    for item in items:
        if item.command_chance < 1:
            fitting = goals_of_command(said_of(item, episode), episode)
            answers = {goal_schema(task).answers[goal] for goal in fitting}
            assert set(item.choice_answers) <= answers, item.text


def test_places_of_the_right_choice_are_balanced():
    """48 episodes: each of four letters twelve times in each of three settings.

    Not in reasoning, which leaves three goals in some scenes.
    """
    places = Counter()
    for index in range(48):
        for item in items_of("StopCube", index)[1]:
            if item.setting != "reasoning":
                places[item.setting, item.choice] += 1

    assert set(places.values()) == {12}
    assert len(places) == 3 * 4


def test_no_two_items_have_the_same_id():
    """An item is a question about an instruction. Here are those of one episode of each task, in
    all settings and forms.
    """
    ids = []
    for task in BENCHMARK:
        _, items = items_of(task, 1, forms=FORMS, every_variant=True)
        ids += [item.id for item in items]

    assert len(set(ids)) == len(ids)


def test_the_id_of_an_item_does_not_depend_on_the_answer():
    """The same episode with each goal of its scene has one id, which so does not tell the
    answer.
    """
    episode = get_episode("PickXtimes", "test", 3)
    options = InstructionOptions("direct")
    goals = get_task("PickXtimes").goals(episode.scene)

    ids = {item_id(replace(episode, goal=goal), options) for goal in goals}

    assert len(goals) > 1
    assert ids == {item_id(episode, options)}


def test_the_test_split_has_2550_items():
    """50 episodes of 11 tasks in four settings, and of seven tasks in spatial, too."""
    counts = Counter()
    for task in BENCHMARK:
        for index in range(SIZES["test"]):
            episode = get_episode(task, "test", index)
            wanted = wanted_options(
                episode, SETTINGS, ("implicit",), InstructionOptions(), every_variant=False
            )
            counts.update(options.setting for options in wanted)

    assert counts["spatial"] == 50 * 7
    assert counts.total() == 50 * (4 * 11 + 7) == 2550


@pytest.mark.parametrize("name", ["delivery", "stages", "frame"])
def test_options_that_a_setting_does_not_read_keep_their_defaults(name):
    """The defaults are a prompt, all stages, and the robot's frame of reference."""
    episode = get_episode("PickXtimes", "test", 3)
    asked = InstructionOptions(delivery="turns", stages=(1, 5), frame="camera", wordings="train")

    for options in wanted_options(episode, SETTINGS, FORMS, asked, every_variant=True):
        assert options.wordings == "train"
        if name not in all_settings()[options.setting].reads:
            assert getattr(options, name) == getattr(InstructionOptions(), name), options.setting


@settings(max_examples=30)
@given(mask=arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=9)))
def test_a_mask_is_read_back_from_its_run_lengths(mask):
    """A mask is stored as numbers of equal pixels in a row: first of those outside (which may be
    0), then inside, and so on. Any mask of up to 9 × 9 pixels is the same after it was stored.
    """
    counts = encode_mask(mask)

    assert all(counts[1:])
    assert (decode_mask(counts, mask.shape) == mask).all()


@settings(max_examples=30)
@given(mask=arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=9)))
def test_the_pixel_nearest_to_the_center_of_a_mask_is_in_it(mask):
    """Also in a mask with a hole in its center; an empty mask has no such pixel and is left out."""
    if mask.any():
        assert mask[nearest_to_center(mask)]


def test_runs_that_do_not_fill_the_picture_are_refused():
    """Runs of 1 and 2 pixels make 3, and the picture has 2 × 2."""
    with pytest.raises(InvalidValueError, match="cover 3 pixels; they must cover 2 x 2"):
        decode_mask([1, 2], (2, 2))


def test_run_lengths_go_down_the_columns():
    """By columns the pixels are False, True, True, True: one outside the mask, then three in it."""
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
    """A task's words tell things of these kinds apart, so an answer points at them."""
    assert pointed_kinds(task) == kinds


def test_a_hidden_cube_that_appears_later_is_pointed_at_where_it_will_be():
    """In ButtonUnmask a cube appears once the button is pressed; it is the goal's color."""
    episode = get_episode("ButtonUnmask", "test", 0)

    (referent,) = find_referents(episode)

    assert referent.kind == "hidden_cube"
    assert episode.scene[referent.objects[0]].color == episode.goal.texts("colors")[0]


def test_a_cube_that_was_hidden_in_the_video_is_pointed_at_by_its_container():
    """The one thing to point at is a container, and the cube in it has the goal's color."""
    episode = get_episode("VideoUnmask", "test", 0)

    (referent,) = find_referents(episode)

    hidden = episode.scene.hidden_in(referent.objects[0])
    assert hidden.color == episode.goal.texts("colors")[0]


def test_of_an_amount_every_thing_of_the_color_will_do():
    """The goal is three red cubes and a green one. A referent is what an answer points at: for each
    color of the goal, any cube of it is right, and none of another color, such as the blue one.
    """
    episode = get_episode("BinFill", "test", 3)

    green, red = find_referents(episode)

    assert set(green.objects) == {"cube_green_0", "cube_green_1", "cube_green_2"}
    assert set(red.objects) == {f"cube_red_{number}" for number in range(6)}


def test_a_question_has_the_instruction_and_the_choices_with_their_letters():
    """In each setting of an episode, the question of choice lists lines such as "A. pick ..."."""
    _, items = items_of("PickXtimes", 0)

    for item in items:
        assert item.text in item.said
        for letter, choice in zip(LETTERS, item.choices, strict=False):
            assert f"{letter}. {choice}" in item.choice_question


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The request, folder and counts of a dataset of five episodes (`SEEN`) in all settings.

    A video is shown by four frames; its film has every 16th picture.
    """
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
    """A point is a pixel to point at, with the mask of the pixels that are right, and a referent
    has the names of the things that are meant. `project` computes from the simulator's poses and
    the camera where the center of a thing is in the picture; masks come from the renderer.

    A cube is some 15 pixels wide. The pixel lies in the mask; the mask has a pixel within 9 of the
    center of a thing that is meant, which may be half hidden; and if one thing alone is meant, the
    middle of the mask is less than 12 pixels from it.
    """
    _, folder, _ = exported
    items = {item.task: item for item in read_items(folder) if item.setting == "direct"}
    episode = get_episode(task, "test", index)
    env = RoboIRGEnv(episode, cameras=("front",), calibration=True, demonstration_frames="none")
    observation, _ = env.reset()

    for point, referent in zip(items[task].points, find_referents(episode), strict=True):
        rows, columns = np.nonzero(point.mask)
        nearest = []
        for name in referent.objects:
            column, row = project(observation, env.session.world.bodies[name].position)
            nearest.append(np.hypot(rows - row, columns - column).min())
        assert point.mask[point.y, point.x]
        assert min(nearest) <= 9
        if len(nearest) == 1:
            assert np.hypot(rows.mean() - row, columns.mean() - column) < 12


def project(observation, position):
    """Column and row of a point of the world in the front picture."""
    place = observation["front_extrinsic"] @ np.append(position, 1.0)
    x, y, depth = observation["front_intrinsic"] @ place
    return round(x / depth), round(y / depth)


@pytest.mark.sim
def test_pictures_are_stored_once_and_all_are_there(exported):
    """Items share pictures: there are as many files as different paths, and as were counted."""
    _, folder, facts = exported
    paths = set()
    for item in read_items(folder):
        paths |= {item.picture, *item.frames}

    assert facts.pictures == len(paths) == len(list((folder / "pictures").iterdir()))
    assert all((folder / path).is_file() for path in paths)


@pytest.mark.sim
def test_a_task_with_a_video_has_its_film_at_the_speed_at_which_it_happened(exported):
    """The film shows one of `frames_every` control steps, so its rate is lower by as much."""
    request, folder, _ = exported
    items = read_items(folder)

    (item,) = [item for item in items if item.task == "VideoUnmask" and item.setting == "direct"]

    with av.open(str(folder / item.video)) as film:
        assert film.format.name.startswith("mov,mp4")
        assert film.streams.video[0].average_rate == CONTROL_RATE / request.frames_every
    assert len(item.frames) == request.frames


@pytest.mark.sim
def test_a_task_without_a_video_has_no_film(exported):
    _, folder, _ = exported

    tasks = {item.task for item in read_items(folder) if item.video is not None}

    assert tasks == {"VideoUnmask"}


@pytest.mark.sim
def test_the_table_has_every_item_with_its_pictures(exported):
    """The dataset is written as JSON lines with paths of pictures, and as a table (Parquet) that
    holds the pictures themselves. The table has all items in the same order, and says to the
    library `datasets` that picture and frames are images.
    """
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
    """The stored text has the number of items, pictures and videos, the size of the files, and the
    lines of Python that load them.

    Given are items of two splits, of which those of StopCube have a film, and a file of 3 MiB.
    Items are not made from scenes here, and no table is written.
    """
    _, with_film = items_of("StopCube", 1, split="val")
    _, without_film = items_of("BinFill", 1, every_variant=True)
    items = [msgspec.structs.replace(item, video="StopCube.mp4") for item in with_film]
    monkeypatch.setattr(dataset_export, "collect_items", lambda *_: items + without_film)
    monkeypatch.setattr(dataset_export, "write_parquet", lambda *_: None)
    (tmp_path / "large").write_bytes(bytes(3 << 20))
    request = ExportRequest((), (), (), frames=8, frames_every=16)

    digest = export_grounding(request, tmp_path, 0).sha256

    card = (tmp_path / CARD).read_text().replace(digest, "SHA-256")
    assert card.replace(__version__, "VERSION") == snapshot


def test_a_folder_of_something_else_is_not_touched(tmp_path):
    """The folder holds somebody's thesis, so no dataset is written there."""
    (tmp_path / "thesis.tex").write_text("mine")
    request = ExportRequest((("StopCube", "test", 0),), ("explicit",), ("implicit",))
    with pytest.raises(InvalidValueError, match="not an empty folder"):
        export_grounding(request, tmp_path, 0)
