"""Strips of pictures: the failure under its explicit play, with the moment at which it failed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_records import make_record
from msgspec.structs import replace
from page_text import store

from roboirg.evaluation.analysis.figures import write_figures
from roboirg.evaluation.analysis.figures.strips import PICTURES, draw_strips, shown_steps
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.play.video_writer import VideoWriter
from roboirg.evaluation.records.record import Attribution, Record, SubgoalRecord

pytest.importorskip("matplotlib")
pytest.importorskip("av")

from matplotlib.figure import Figure

STEPS, MOMENT = 160, 72
PLAN = Plan(
    policies=("forgetful",), tasks=("PickXtimes",), settings=("explicit", "direct"), episodes=(0,)
)


class Clock:
    """A world whose pictures are as bright as the step is late."""

    step = 0

    def picture(self, camera: str) -> np.ndarray:
        return np.full((256, 256, 3), self.step + 40, np.uint8)


def film(path: Path, demonstration: int = 0) -> None:
    """Write the film of an episode, with a video of what happened before it."""
    writer = VideoWriter(path)
    writer.caption = "Do it."
    world = Clock()
    for _ in range(demonstration):
        writer.add_frame(world, is_demonstration=True)  # type: ignore[arg-type]
    for step in range(0, STEPS + 1, writer.every):
        world.step = step
        writer.add_frame(world)  # type: ignore[arg-type]
    assert writer.finish()


def records() -> list[Record]:
    """The explicit record, then the one that failed."""
    found = []
    for job in sorted(PLAN.jobs(), key=lambda one: one.setting != "explicit"):
        lost = job.setting != "explicit"
        outcome = ("failure", "picked the wrong") if lost else ("success",)
        made = make_record(job, *outcome, steps=STEPS, started_at="2026-01-02T03:04:05+00:00")
        wrong = Attribution(kind="grounding", failure="wrong_object", step=MOMENT, sentence="So.")
        subgoals = tuple(
            SubgoalRecord(step=step, text=text, verdict="wrong_thing")
            for step, text in ((50, "lift the red cube"), (100, "put it down"))
        )
        found.append(
            replace(
                made,
                video=f"videos/{job.setting}.mp4",
                attribution=wrong if lost else None,
                subgoals=subgoals if lost else (),
            )
        )
    return found


def a_run(folder: Path, found: list[Record]) -> Path:
    for number, record in enumerate(found):
        if record.video is not None:
            film(folder / record.video, demonstration=5 * number)
    return store(folder, found).folder


def drawn(figure: Figure | None) -> list[list[tuple[str, float, bool]]]:
    """Return what stands below each picture, its brightness, and whether it is marked."""
    assert figure is not None
    return [
        [
            (
                one.get_xlabel(),
                float(one.images[0].get_array()[100:150, 100:150].mean()),  # type: ignore[index]
                one.spines["left"].get_linewidth() > 1,
            )
            for one in row.axes
        ]
        for row in figure.subfigs
    ]


def test_a_strip_shows_the_pictures_of_its_steps_and_marks_the_moment(tmp_path: Path) -> None:
    found = records()
    source = Source(a_run(tmp_path, found))
    explicit, failed = drawn(draw_strips([source]))
    for row, record in ((explicit, found[0]), (failed, found[1])):
        steps = shown_steps(record)
        assert len(row) == len(steps) == PICTURES
        for (label, brightness, _), step in zip(row, steps, strict=True):
            assert label.startswith(f"{step / 20:.1f} s")
            assert abs(brightness - step - 40) < 6  # half the time between two frames, and H.264
    assert not any(marked for *_, marked in explicit)
    assert [label.partition("\n")[0] for label, _, marked in failed if marked] == ["3.6 s"]
    assert ["lift the red" in label for label, *_ in failed] == [False, False, True, False, False]
    out = tmp_path / "figures"
    assert write_figures(RunData(make_frame([("run", found)])), out, ["strips"], runs=[source])
    assert "Picked the wrong." in (out / "strips.svg").read_text()


def test_without_the_explicit_film_there_is_no_strip(tmp_path: Path) -> None:
    explicit, failed = records()
    folder = a_run(tmp_path, [replace(explicit, video=None), failed])
    assert draw_strips([Source(folder)]) is None
