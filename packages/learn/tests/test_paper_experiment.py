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


@pytest.mark.parametrize("part", PARTS)
def test_held_out_words_are_spoken_in_episodes_of_validation(part):
    changes = {"episodes": "1", "split": "val", "tasks": "PickXtimes"}

    jobs = jobs_of(part_options(part, ExperimentPlan(), FILES, changes))

    assert {job.options.wordings for job in jobs} == {"test"}


def test_episodes_of_the_test_split_need_no_choice_of_words():
    """Their own words are those held out from training."""
    jobs = jobs_of(part_options("main", ExperimentPlan(), FILES, {"episodes": "1"}))

    assert {job.options.wordings for job in jobs} == {None}


def values_in_row(section, row):
    """Return the numbers in a row of the table of a section of the page; None for a dash."""
    (line,) = [line for line in section.splitlines() if line.startswith(f"| {row} |")]
    found = []
    for cell in line.split("|")[2:-1]:
        text = cell.strip().split(" ")[0].strip("\\*")
        found.append(None if text == "–" else float(text))
    return found


def results_of_small_policies(table, *systems):
    """Return results of small policies with the published rates of the systems they stand for."""
    found = []
    for system in systems:
        for result in like_published(table, system):
            found.append(msgspec.structs.replace(result, policy=ROW_OF[system]))
    return found


def all_won_in_resolved_form(results):
    """Return the implicit results once more in the resolved form, all won."""
    found = []
    for result in results:
        if result.options.setting != "explicit":
            options = replace(result.options, form="resolved")
            found.append(msgspec.structs.replace(result, outcome="success", options=options))
    return found


def sections_of_answers(part, results):
    """Return the sections of the page with the answers, of the results of a part."""
    frame = make_frame([(part, results)])
    columns = pd.DataFrame({name: frame[name] for name in frame})
    filmed = {task: len(get_episode(task, "test", 0).demonstration) for task in all_tasks()}
    columns["demonstration_steps"] = columns["task"].map(filmed)
    return answers_text({part: columns}).split("### ")[1:]


@pytest.fixture(scope="module")
def answers_with_published_rates():
    """The four answers of the main part, for results with the paper's rates of two systems."""
    results = results_of_small_policies("main", "pi0.5", "FrameS-Modul")
    return sections_of_answers("main", results)


@pytest.mark.parametrize(
    ("answer", "numbers"),
    [
        (0, [-16.1, -29.0, -23.1, -26.5]),
        (1, [23.1, 8.6, 3.3, 5.4, 7.5]),
        (2, [39.8, 5.3, 24.4, 17.3]),
        (3, [65, 37, 50, 43]),
    ],
    ids=["cost of each setting", "memory in each setting", "where memory helps", "what is kept"],
)
def test_published_success_rates_give_the_published_answers(
    answers_with_published_rates, answer, numbers
):
    """The paper's row of each answer, and that of the small policy with the same rates."""
    section = answers_with_published_rates[answer]

    assert values_in_row(section, "FrameS-Modul") == numbers
    assert values_in_row(section, "small-framesamp") == numbers


def test_resolved_forms_are_compared_with_their_references_and_with_nothing_else():
    """Of pi0.5, implicit settings win 21.2, 13.6, 17.3 and 12.4 %; resolved, all are won."""
    results = results_of_small_policies("main", "pi0.5", "FrameS-Modul")

    found = sections_of_answers("main", [*results, *all_won_in_resolved_form(results)])

    lost = [100 - 21.2, 100 - 13.6, 100 - 17.3, 100 - 12.4]
    assert values_in_row(found[-1], "small-none") == pytest.approx(lost, abs=0.2)
    assert values_in_row(found[1], "small-framesamp") == [23.1, 8.6, 3.3, 5.4, 7.5]


@pytest.mark.parametrize("system", ["FrameS-Modul", "GroundSG-QwenVL"])
def test_effects_of_context_are_differences_to_the_fewest_stages(system):
    section = sections_of_answers("context", results_of_small_policies("context", system))[-1]

    own = values_in_row(section, ROW_OF[system])
    assert own == pytest.approx(values_in_row(section, system), abs=0.11)


def test_the_published_effect_of_the_longest_context_is_minus_4_points():
    """FrameS-Modul wins 29.11 % with the fewest stages, and 24.44 % with all."""
    results = results_of_small_policies("context", "FrameS-Modul")

    section = sections_of_answers("context", results)[-1]

    assert values_in_row(section, "FrameS-Modul")[-1] == pytest.approx(-4.67, abs=0.1)


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
