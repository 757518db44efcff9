#!/usr/bin/env python3
"""Convert RoboMME's published episodes into the data file that the package ships.

Reads ``{train,val,test}.jsonl.gz`` (one JSON object per episode: the poses of all bodies after the
scene was made, and what the task drew) and writes
``src/roboirg/tasks/splits/published.jsonl.gz``, one scene and goal per line in our own terms. The
input comes from a running RoboMME (Apache-2.0, see NOTICE); ``tests/episodes/robomme`` holds a
copy.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.core import object_sizes
from roboirg.core.conditions import Fact
from roboirg.core.episode import SPLITS, Color, Goal, Scene, SceneObject
from roboirg.core.motions import Motion, Point, Shuttle
from roboirg.tasks import bin_fill, stop_cube, swing_x_times, video_repick
from roboirg.tasks.shared import unmask, unmask_swap, video_place
from roboirg.tasks.splits.recordings import FOLDER, INCOMPLETE
from roboirg.tasks.splits.scene_codec import encode

Row = Mapping[str, Any]
Body = Sequence[float]
"""x, y, z (m) and the quaternion (w, x, y, z)."""

COLOR_OF_RGB: dict[tuple[float, ...], Color] = {
    (1.0, 0.0, 0.0): "red",
    (0.0, 1.0, 0.0): "green",
    (0.0, 0.0, 1.0): "blue",
}


def main() -> None:
    """Write the data file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", type=Path, help="with train.jsonl.gz, val.jsonl.gz, test.jsonl.gz"
    )
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    text = "".join(f"{line}\n" for line in converted_lines(arguments.folder))
    arguments.out.write_bytes(gzip.compress(text.encode(), 9, mtime=0))
    write_recordings(arguments.folder, arguments.out.parent / FOLDER)
    print(hashlib.sha256(text.encode()).hexdigest(), len(text), arguments.out.stat().st_size)


def write_recordings(folder: Path, out: Path) -> None:
    """Write the recorded actions of each task and split, without the step at home at their end."""
    out.mkdir(exist_ok=True)
    arrays: dict[tuple[str, str], dict[str, Any]] = {}
    for row in read_rows(folder):
        key = task, split, index = row["task"], row["dataset"], row["episode"]
        source = folder / f"{split}-{task}.npz"
        if "error" in row or key in INCOMPLETE or not source.exists():
            continue
        with np.load(source) as recorded:
            actions, current = recorded[f"actions_{index}"], recorded[f"stage_{index}"]
        unseen = row["elapsed"] - row["frames"]
        last = sum(stage["demonstration"] for stage in row["stages"]) - 1
        # The judge's stage runs ahead of the hand's: the arm is still on its way home.
        stages = np.minimum(current, last - 1).astype(np.uint8)[:-1]
        stages[len(stages) - unseen :] = last
        arrays.setdefault((task, split), {}).update(
            {f"actions_{index}": actions[:-1], f"stages_{index}": stages}
        )
    for (task, split), content in arrays.items():
        np.savez_compressed(out / f"{task}-{split}.npz", **content)


def converted_lines(folder: Path) -> Iterator[str]:
    """Yield a line of JSON for each episode that builds."""
    for row in read_rows(folder):
        if "error" in row:
            continue
        scene, goal = CONVERTERS[row["task"]](row)
        entry = {
            "task": row["task"],
            "split": row["dataset"],
            "index": row["episode"],
            "seed": row["seed"],
            "difficulty": row["difficulty"],
            "scene": encode(scene),
            "goal": encode(goal),
        }
        yield json.dumps(entry, separators=(",", ":"))


def read_rows(folder: Path) -> Iterator[Row]:
    """Yield every row of the three files, in the order of splits and lines."""
    for split in SPLITS:
        with gzip.open(folder / f"{split}.jsonl.gz", "rt", encoding="utf-8") as file:
            yield from map(json.loads, file)


def body_name(reference: object) -> str:
    """Return ``cube_red_0`` for ``<cube_red_0>``, also in a list of one."""
    text = reference[0] if isinstance(reference, list) else reference
    return str(text).strip("<>")


# --- one function for each kind of body ------------------------------------------------------


def upright_yaw(body: Body) -> float:
    """Return the yaw of a body that is only turned about the vertical, rad."""
    return 2.0 * math.atan2(body[6], body[3])


def make_button(row: Row, source: str = "button", name: str = "button") -> SceneObject:
    """Return a button at the height of its origin."""
    x, y, *_ = row["start"][source]["pose"]
    return SceneObject(name, "button", Point(x, y, object_sizes.BUTTON_HEIGHT))


def make_cube(row: Row, source: str, name: str, color: Color) -> SceneObject:
    """Return a cube that lies on the table."""
    body = row["start"][source]
    position = Point(body[0], body[1], object_sizes.CUBE_HALF)
    return SceneObject(name, "cube", position, upright_yaw(body), color)


def make_target(row: Row, source: str, name: str, radius: float, **look: Any) -> SceneObject:  # noqa: ANN401 - fields of SceneObject
    """Return a target disc."""
    x, y, *_ = row["start"][source]
    height = look.pop("height", object_sizes.TARGET_HEIGHT)
    return SceneObject(name, "target", Point(x, y, height), radius=radius, **look)


def colored_cubes(row: Row) -> tuple[SceneObject, ...]:
    """Return the cubes of a table with at most one of each color, ``cube_red`` and so on."""
    sources = [body_name(one) for one in row["facts"]["all_cubes"]]
    return tuple(
        make_cube(row, source, f"cube_{color}", color)
        for source in sources
        for color in [color_in(source)]
    )


def color_in(source: str) -> Color:
    """Return the color in a body's name."""
    return next(color for color in COLOR_OF_RGB.values() if color in source)


# --- one function for each task --------------------------------------------------------------


def pick_x_times(row: Row) -> tuple[Scene, Goal]:
    """Button, cubes, target."""
    facts = row["facts"]
    objects = (
        make_button(row),
        *colored_cubes(row),
        make_target(row, "target", "target", 0.04),
    )
    return Scene(objects), Goal.of(color=facts["target_color_name"], repeats=facts["num_repeats"])


def convert_stop_cube(row: Row) -> tuple[Scene, Goal]:
    """Button, target, and the cube that runs over it."""
    facts = row["facts"]
    target = make_target(
        row,
        "target",
        "target",
        stop_cube.TARGET_RADIUS,
        height=stop_cube.HEIGHT,
        thickness=stop_cube.TARGET_THICKNESS,
    )
    begin, end = (
        Point(round(x, 7), round(y, 7), stop_cube.HEIGHT)
        for x, y in (facts["start_pos_xy"], facts["end_pos_xy"])
    )
    red, green, blue = row["colors"]["target_cube"]
    yaw = upright_yaw(row["start"]["target_cube"])
    shuttle = SceneObject("shuttle", "shuttle", begin, yaw, rgb=(red, green, blue))
    run = Shuttle(
        "shuttle",
        begin,
        end,
        facts["move_interval"],
        stop_cube.PASSES,
        stopped_by=Fact("pressed", "button"),
    )
    return (
        Scene((make_button(row), target, shuttle), motions=(run,)),
        Goal.of(visit=facts["stop_time"]),
    )


def convert_swing_x_times(row: Row) -> tuple[Scene, Goal]:
    """Button, cubes, and a target on either side with the disc that lights up over it."""
    facts = row["facts"]
    targets = tuple(
        make_target(
            row,
            body_name(facts[f"target_{side}"]),
            f"target_{side}",
            swing_x_times.TARGET_RADIUS,
            rgb=swing_x_times.TARGET_RGB,
        )
        for side in swing_x_times.SIDES
    )
    color = facts["target_color_name"]
    scene = swing_x_times.make_scene(make_button(row), colored_cubes(row), targets, f"cube_{color}")
    return scene, Goal.of(color=color, repeats=facts["num_repeats"])


def convert_bin_fill(row: Row) -> tuple[Scene, Goal]:
    """Button, bin and cubes, numbered within their color in the order of creation."""
    facts = row["facts"]
    body = row["start"]["board_with_hole"]
    bin_ = SceneObject(
        "bin", "bin", Point(body[0], body[1], object_sizes.BIN_HEIGHT / 2), upright_yaw(body)
    )
    cubes: list[SceneObject] = []
    for source in (body_name(one) for one in facts["all_cubes"]):
        color = color_in(source)
        number = sum(cube.color == color for cube in cubes)
        cubes.append(make_cube(row, source, f"cube_{color}_{number}", color))
    counts = {color: facts[f"{color}_cubes_target_number"] for color in bin_fill.GOAL_ORDER}
    named = tuple(color for color in bin_fill.GOAL_ORDER if counts[color])
    goal = Goal.of(colors=named, counts=tuple(counts[color] for color in named))
    motions = bin_fill.plan_motions(cubes, late=facts["dynamic"])
    order = tuple(color for color, _ in facts["binfill_language_sequence"])
    return Scene((make_button(row), bin_, *cubes), motions, color_order=order), goal


def unmask_scene(row: Row, *buttons: SceneObject) -> tuple[Scene, Goal]:
    """Containers, three of which hide a cube: container i hides the color i."""
    facts = row["facts"]
    containers = make_containers(row)
    colors: list[Color] = facts["color_names"]
    cubes = tuple(
        unmask.hidden_cube(color, container)
        for color, container in zip(colors, containers, strict=False)
    )
    picks = sum(
        str(stage["segment"]).startswith("<bin_")
        for stage in row["stages"]
        if not stage["demonstration"]
    )
    scene = Scene((*buttons, *containers, *cubes), motions=unmask.appearing(containers))
    return scene, Goal.of(colors=tuple(colors[:picks]))


def unmask_swap_scene(row: Row, *buttons: SceneObject) -> tuple[Scene, Goal]:
    """Containers that change places, three of which hide a cube."""
    facts = row["facts"]
    containers = make_containers(row)
    by_source = {
        body_name(one): container
        for one, container in zip(facts["spawned_bins"], containers, strict=True)
    }
    covers = {
        color_in(body_name(cube)): by_source[body_name(cover)]
        for cube, cover in facts["cube_bin_pairs"]
    }
    colors: list[Color] = facts["color_names"]
    cubes = tuple(unmask.hidden_cube(color, covers[color]) for color in colors)
    initiators = tuple(
        by_source[body_name(facts[f"swap_pair{number}_idx1"])].name
        for number in range(1, facts["swap_times"] + 1)
    )
    scene = Scene(
        (*buttons, *containers, *cubes), unmask_swap.plan_motions(containers, cubes, initiators)
    )
    return scene, Goal.of(colors=tuple(colors[: facts["pick_times"]]))


def make_containers(row: Row) -> tuple[SceneObject, ...]:
    """Return the containers in the order of creation; their quaternions are yaw · (0, 1, 0, 0)."""
    found = []
    for number, source in enumerate(body_name(one) for one in row["facts"]["spawned_bins"]):
        body = row["start"][source]
        yaw = 2.0 * math.atan2(body[5], body[4])
        position = Point(body[0], body[1], object_sizes.CONTAINER_HEIGHT)
        found.append(SceneObject(f"container_{number}", "container", position, yaw))
    return tuple(found)


def button_unmask(row: Row) -> tuple[Scene, Goal]:
    """As `unmask_scene`, with a button."""
    return unmask_scene(row, make_button(row))


def button_unmask_swap(row: Row) -> tuple[Scene, Goal]:
    """As `unmask_swap_scene`, with two buttons; RoboMME's left is the robot's right."""
    facts = row["facts"]
    buttons = (
        make_button(row, body_name(facts["button_left"]), "button_right"),
        make_button(row, body_name(facts["button_right"]), "button_left"),
    )
    return unmask_swap_scene(row, *buttons)


def convert_video_repick(row: Row) -> tuple[Scene, Goal]:
    """Button and cubes; what is called ``bin_N`` is a cube, too."""
    facts = row["facts"]
    names: dict[str, str] = {}
    cubes: list[SceneObject] = []
    for source in (body_name(one) for one in facts["spawned_cubes"]):
        color = COLOR_OF_RGB[tuple(row["colors"][source])]
        number = sum(cube.color == color for cube in cubes)
        names[source] = f"cube_{color}_{number}"
        cubes.append(make_cube(row, source, names[source], color))
    target = names[body_name(facts["target_cube_1"])]
    initiators = tuple(
        names[body_name(facts[f"swap_pair{number}_idx1"])]
        for number in range(1, facts["swap_times"] + 1)
    )
    # RoboMME looks for the nearest cube once the first one has been put down, millimeters away.
    partners = [
        None if second is None else names[body_name(second)]
        for _, second, *_ in facts.get("swap_schedule", ())
    ]
    scene = video_repick.make_scene(make_button(row), cubes, target, initiators, partners)
    return scene, Goal.of(repeats=facts["num_repeats"])


def place_scene(row: Row, site_radius: float) -> tuple[Scene, str]:
    """The table of a Place task, its video and exchange, and the color that is wanted."""
    facts = row["facts"]
    x, y, *_ = row["start"]["goal_site"]
    site = SceneObject("site", "site", Point(x, y, object_sizes.TARGET_HEIGHT), radius=site_radius)
    discs = tuple(
        make_target(row, body_name(one), f"target_{number}", video_place.TARGET_RADIUS)
        for number, one in enumerate(facts["targets"])
    )
    color = facts["target_color_name"]
    past = tuple(past_of(row, f"cube_{color}"))
    swaps: tuple[Motion, ...] = ()
    if "swap_target_a" in facts:
        first, second = (body_name(facts[f"swap_target_{one}"]) for one in "ab")
        others = tuple(disc.name for disc in discs if disc.name not in (first, second))
        swaps = (video_place.plan_swap(first, second, others, past),)
    return Scene((site, make_button(row), *colored_cubes(row), *discs), swaps, past), color


def past_of(row: Row, cube: str) -> Iterator[Fact]:
    """Yield what the video shows: a placement for each target, the press for the button."""
    for stage in row["stages"]:
        if not stage["demonstration"] or stage["segment"] is None:
            continue
        name = body_name(stage["segment"])
        if name.startswith("target_"):
            yield Fact("placed", cube, name)
        elif name == "button_cap":
            yield Fact("pressed", "button")


def video_place_button(row: Row) -> tuple[Scene, Goal]:
    """The disc of before or after the press is wanted."""
    scene, color = place_scene(row, 0.06)
    return scene, Goal.of(color=color, relation=row["facts"]["target_target_language"])


def video_place_order(row: Row) -> tuple[Scene, Goal]:
    """The disc of a placement is wanted."""
    scene, color = place_scene(row, 0.1)
    return scene, Goal.of(color=color, placement=row["facts"]["which_in_subset"])


CONVERTERS: dict[str, Callable[[Row], tuple[Scene, Goal]]] = {
    "PickXtimes": pick_x_times,
    "StopCube": convert_stop_cube,
    "SwingXtimes": convert_swing_x_times,
    "BinFill": convert_bin_fill,
    "VideoUnmask": unmask_scene,
    "VideoUnmaskSwap": unmask_swap_scene,
    "ButtonUnmask": button_unmask,
    "ButtonUnmaskSwap": button_unmask_swap,
    "VideoRepick": convert_video_repick,
    "VideoPlaceButton": video_place_button,
    "VideoPlaceOrder": video_place_order,
}


if __name__ == "__main__":
    main()
