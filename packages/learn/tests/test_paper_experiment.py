"""The paper's experiment with small policies: what is played, and what is asked of both."""

from dataclasses import replace
from pathlib import Path

import msgspec
import pandas as pd
import pytest
from published_results import like_published

from roboirg.analysis.results.frame import make_frame
from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.policy_kinds import split_spec
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.policy.paper_experiment import (
    PARTS,
    SYSTEMS,
    ExperimentPlan,
    check_experiment,
    part_options,
    row_name,
)
from roboirg_learn.policy.paper_page import answers_text
from roboirg_learn.policy.policy_files import PolicyFiles

FILES = {
    row_name(memory): PolicyFiles(Path(f"{memory}.body"), Path("my words.reader"))
    for memory in SYSTEMS
}
ROW_OF = {system: row_name(memory) for memory, system in SYSTEMS.items()}


def jobs_of(options):
    """Return what one policy plays; those of the options need PyTorch and files."""
    others = {name: value for name, value in options.items() if name != "policy"}
    return make_plan(**others, policies=["oracle"]).jobs()


@pytest.mark.parametrize(
    ("part", "cells", "policies"),
    [("main", 51, 5), ("resolved", 91, 5), ("context", 12, 5), ("planner", 15, 7)],
)
def test_each_part_of_the_experiment_plays_the_cells_of_the_paper(part, cells, policies):
    """A cell is a task in a setting and a form; two episodes of each are played."""
    options = part_options(part, ExperimentPlan(), FILES, {"episodes": "2"})
    assert len(options["policy"]) == policies
    assert len(jobs_of(options)) == cells * 2


def test_policies_of_the_planner_part_are_named_with_their_files():
    """A body acts, and a reader turns words into a goal; both are files."""
    policies = part_options("planner", ExperimentPlan(), FILES, {})["policy"]
    hands = [dict(split_spec(name, spec).options) for name, spec in policies.items()]
    own = "trained:subgoal.body?reader=my%20words.reader"

    assert policies["small-subgoal"] == own
    assert {"hands": own} in hands
    assert {"reader": "my words.reader", "hands": "scripted"} in hands


def test_held_out_words_are_spoken_in_every_split():
    changes = {"episodes": "1", "split": "val", "tasks": "PickXtimes"}
    for part in PARTS:
        jobs = jobs_of(part_options(part, ExperimentPlan(), FILES, changes))
        assert {job.options.wordings for job in jobs} == {"test"}

    jobs = jobs_of(part_options("main", ExperimentPlan(), FILES, {"episodes": "1"}))
    assert {job.options.wordings for job in jobs} == {None}


def values_in_row(section, row):
    """Return the differences in a row of a section's table."""
    line = next(line for line in section.splitlines() if line.startswith(f"| {row} |"))
    texts = [part.strip().split(" ")[0].strip("\\*") for part in line.split("|")[2:-1]]
    return [None if text == "–" else float(text) for text in texts]


def rows_like(found):
    """Return published-like results as those of the rows of the systems."""
    return [
        msgspec.structs.replace(result, policy=ROW_OF[result.policy])
        for result in found
        if result.policy in ROW_OF
    ]


def all_won_in_resolved_form(results):
    """Return their implicit results in the resolved form, all won."""
    return [
        msgspec.structs.replace(
            result, outcome="success", options=replace(result.options, form="resolved")
        )
        for result in results
        if result.options.setting != "explicit"
    ]


def sections_of_answers(part, *results):
    frame = make_frame([(part, [*results])])
    columns = pd.DataFrame({name: frame[name] for name in frame})
    filmed = {task: len(get_episode(task, "test", 0).demonstration) for task in all_tasks()}
    columns["demonstration_steps"] = columns["task"].map(filmed)
    return answers_text({part: columns}).split("### ")[1:]


def test_published_success_rates_give_the_published_answers():
    """Resolved forms are compared with references, and with nothing else."""
    systems = "pi0.5", "FrameS-Modul"
    found = rows_like(result for system in systems for result in like_published("main", system))
    cache, apart, where, kept = sections_of_answers("main", *found)
    for system in systems:
        row = ROW_OF[system]
        assert values_in_row(cache, row) == pytest.approx(values_in_row(cache, system), abs=0.11)
        assert values_in_row(kept, row) == pytest.approx(values_in_row(kept, system), abs=1.01)
        if row != row_name("none"):
            assert values_in_row(apart, row) == pytest.approx(
                values_in_row(apart, system), abs=0.11
            )
            assert values_in_row(where, row) == pytest.approx(
                values_in_row(where, system), abs=0.11
            )
    assert values_in_row(where, "FrameS-Modul") == pytest.approx([39.8, 5.3, 24.4, 17.3], abs=0.1)
    assert values_in_row(cache, "FrameS-Modul")[0] == pytest.approx(-16.1, abs=0.1)

    both = sections_of_answers("main", *found, *all_won_in_resolved_form(found))
    lost = [100 - 21.2, 100 - 13.6, 100 - 17.3, 100 - 12.4]
    assert values_in_row(both[-1], "small-none") == pytest.approx(lost, abs=0.2)
    assert values_in_row(apart, row) == values_in_row(both[1], row)


def test_effects_of_context_are_differences_to_the_fewest_stages():
    section = sections_of_answers("context", *rows_like(like_published("context")))[-1]
    for system in ("FrameS-Modul", "GroundSG-QwenVL"):
        published = values_in_row(section, system)
        assert values_in_row(section, ROW_OF[system]) == pytest.approx(published, abs=0.11)
    assert values_in_row(section, "FrameS-Modul")[-1] == pytest.approx(24.44 - 29.11, abs=0.1)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"memories": ("perceptual",)}, "perceptual"),
        ({"parts": ("side",)}, "side"),
        ({"played": ("implied",)}, "implied"),
        ({"memories": ("none", "framesamp")}, "memories are none, framesamp"),
    ],
)
def test_an_experiment_with_a_wrong_name_is_refused_before_training(changes, named):
    with pytest.raises(InvalidValueError, match=named):
        check_experiment(ExperimentPlan(**changes))
