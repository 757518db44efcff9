from __future__ import annotations

from pathlib import Path

from evaluation_fakes import FakePlay, small_plan

from roboirg.evaluation.estimate import cell_sizes, estimate, estimate_text
from roboirg.evaluation.plan_maker import make_plan
from roboirg.records.store import RecordStore, read_index


def test_cells_are_counted_by_policy_task_setting_and_form() -> None:
    plan = make_plan(
        ["random"], tasks="PickXtimes,StopCube", forms="implicit,resolved", episodes="3"
    )
    sizes = cell_sizes(plan.jobs())
    assert sizes["random", "StopCube"]["direct"] == {"implicit": 3, "resolved": 3}
    assert sizes["random", "StopCube"]["explicit"] == {"implicit": 3}
    assert "spatial" not in sizes["random", "StopCube"]
    total = sum(count for cell in sizes.values() for forms in cell.values() for count in
                forms.values())  # fmt: skip
    assert total == len(plan.jobs())


def test_what_was_measured_replaces_what_is_assumed(tmp_path: Path) -> None:
    jobs = small_plan(4).jobs()
    with RecordStore(tmp_path) as store:
        for job in jobs[:2]:
            store.append(FakePlay()(job).model_copy(update={"duration_s": 30.0}))
    guess = estimate(jobs, (), 2)
    known = estimate(jobs, read_index(tmp_path).values(), 2)
    assert (guess.episodes, guess.max_steps, guess.is_measured) == (8, 8 * 1300, False)
    assert (known.seconds, known.is_measured) == (8 * 30.0 / 2, True)
    assert "about 2 min on 2 workers" in estimate_text(known, 10, 2)[1]
    assert estimate_text(known, 10, 2)[0] == "10 episodes, 2 already stored."


def test_nothing_left_is_said_so() -> None:
    assert estimate_text(estimate((), (), 1), 5, 1) == ("5 episodes, 5 already stored.",)
