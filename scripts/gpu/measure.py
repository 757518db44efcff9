"""Measure one thing of the tree on the path, and print it as JSON; `check.py` calls this.

`draw FILE` stores pictures and motion of every task, and `compare FILE FILE` compares two such
files; `step` times an eager step and its parts; `workers N CAMERAS CHUNK` measures steps a second.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.step_times import eager_step, stretch
from benchmarks.worker_rates import BothPictures, FrontPicture, WavingPolicy, steps_per_second

from roboirg.core.observations import CAMERAS, FRONT, WRIST
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.tasks import all_tasks
from roboirg.tasks.splits import get_episode

app = typer.Typer(pretty_exceptions_enable=False)

Drawn = Mapping[str, NDArray[Any]]

INDEXES = (0, 3)
"""Episodes of each task: an easy one and a hard one."""
STEPS = 30
FRAME_INTERVAL = 60
"""Of a demonstration, every how many-th step is drawn."""
CLEAR = 8
"""Levels of 255 by which a pixel differs clearly."""


@app.command()
def draw(file: str) -> dict[str, Any]:
    """Store pictures of scenes and demonstrations, states after some steps, and steps of events."""
    drawn: dict[str, NDArray[Any]] = {}
    for task in all_tasks():
        for index in INDEXES:
            for key, array in _draw_episode(task, index):
                drawn[f"{task} {index} {key}"] = array
    np.savez_compressed(file, **drawn)  # type: ignore[arg-type]  # its stub wants one more keyword
    return {"arrays": len(drawn)}


def _draw_episode(task: str, index: int) -> Iterator[tuple[str, NDArray[Any]]]:
    session = EpisodeSession(get_episode(task, "test", index), visible=True)
    world = session.world
    frames: list[NDArray[np.uint8]] = []
    yield from world.cameras.pictures(CAMERAS).items()

    def keep_frame(_stage: object) -> None:
        if world.elapsed % FRAME_INTERVAL == 0:
            frames.append(world.picture(FRONT))

    session.play_demonstration(keep_frame)
    yield from ((f"frame {number}", frame) for number, frame in enumerate(frames))
    for number in range(STEPS):
        action = HOME_ACTION.copy()
        action[:4] += 0.3 * np.sin(number / 5 + np.arange(4))
        session.step(action)
    yield from ((f"after {name}", one) for name, one in world.cameras.pictures(CAMERAS).items())
    yield "motion", session.state_numbers()
    yield "events", np.array([event.step for event in session.events])


@app.command()
def compare(first: str, second: str) -> dict[str, Any]:
    """Compare the arrays of two files."""
    with np.load(first) as one, np.load(second) as other:
        return difference(dict(one), dict(other))


def difference(first: Drawn, second: Drawn) -> dict[str, Any]:
    """Return how pictures differ, in levels of 255, and which motions are not equal to the bit."""
    if first.keys() != second.keys():
        return {"only in one": sorted(first.keys() ^ second.keys())}
    levels = []
    others = []
    for key, array in first.items():
        if array.dtype == np.uint8:
            levels.append(np.abs(array.astype(np.int16) - second[key]).max(axis=-1).ravel())
        elif not np.array_equal(array, second[key]):
            others.append(key)
    pixels = np.concatenate(levels)
    return {
        "pixels": len(pixels),
        "differ": float(np.mean(pixels > 0)),
        "differ clearly": float(np.mean(pixels > CLEAR)),
        "largest": int(pixels.max()),
        "other motion": others,
    }


@app.command()
def step() -> dict[str, float]:
    """Time an eager step for which both cameras draw, whole and in its parts."""
    workload = stretch("VideoPlaceButton", 0, first=130)
    whole = eager_step(workload)
    session = workload.start()
    cameras, durations = session.world.cameras, defaultdict(list)

    @contextmanager
    def part(name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        durations[name].append(time.perf_counter() - start)

    bodies, components = cameras._bodies, cameras._components  # noqa: SLF001 - no other way to time them
    for action in workload.actions:
        with part("physics and rules"):
            session.step(action)
        with part("poses"):
            poses = bodies.poses()
        with part("culling"):
            drawn = {camera: cameras._view_of(camera, poses).bodies for camera in CAMERAS}  # noqa: SLF001
        with part("update"):
            session.world._scene.update_render()  # noqa: SLF001
        with part("submit"):
            for camera in CAMERAS:
                bodies.take_picture(components[camera], drawn[camera])
        for camera in (FRONT, WRIST):
            with part(f"wait for the {camera} picture"):
                components[camera].get_picture(cameras._color)  # noqa: SLF001
    return {"whole": whole, **{name: statistics.median(one) for name, one in durations.items()}}


@app.command()
def workers(count: str, cameras: str, chunk: str) -> dict[str, float]:
    """Return the control steps a second of workers that share one policy's process."""
    kinds = {("2", "1"): BothPictures, ("1", "1"): FrontPicture, ("1", "16"): WavingPolicy}
    return {"steps_per_s": steps_per_second(kinds[cameras, chunk], int(count))}


if __name__ == "__main__":
    print(json.dumps(app(standalone_mode=False)))
