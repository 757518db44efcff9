"""`roboirg.evaluate` and its results; the episodes are not played but for one test."""

import sys

import numpy as np
import pytest
from made_records import make_record

import roboirg
from roboirg.analysis.run_results import Results
from roboirg.api import python_run
from roboirg.core.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from roboirg.policies.builtin.random_policy import RandomPolicy
from roboirg.policies.by_name.finding import policy_of
from roboirg.records.store import RECORDS_FILE, read_records
from roboirg.runs.plan.stored_plans import read_plan


class Still:
    """A policy that stands still, and notes what it is told."""

    cameras = ()
    version = "1"

    def __init__(self):
        self.instructions = []

    def reset(self, instruction, demonstration):
        self.instructions.append(instruction)

    def act(self, observation):
        return np.tile(np.append(observation["joint_positions"], 1.0), (16, 1))


@pytest.fixture
def episodes_decided_by_setting(monkeypatch):
    """Episodes are decided by their setting."""

    def play(job):
        if job.policy != "forgetful" or job.setting == "explicit":
            return make_record(job, "success")
        return make_record(job, "failure", "wrong")

    monkeypatch.setattr(python_run, "episode_runner", lambda plan, folder: play)


THREE_EPISODES = {"tasks": "PickXtimes", "episodes": 3, "workers": 0, "progress": False}


@pytest.fixture
def results_of_two_policies(episodes_decided_by_setting, tmp_path):
    """The results of three episodes in three tellings (explicit has no resolved form).

    The listener wins all, the forgetful policy explicit episodes alone.
    """
    return roboirg.evaluate(
        ["listener", "forgetful"], settings=("explicit", "direct"), forms=["implicit", "resolved"],
        out=tmp_path, **THREE_EPISODES,
    )  # fmt: skip


def test_evaluate_returns_the_records_of_its_episodes(results_of_two_policies, tmp_path):
    """Two policies, three episodes, three tellings: 18 records."""
    results = results_of_two_policies

    assert results.records == read_records(tmp_path)
    assert (len(results.records), results.errors, results.missing) == (18, 0, 0)
    assert results.frame.equals(roboirg.results(tmp_path))


def test_evaluate_returns_success_rates_by_policy_and_setting(results_of_two_policies):
    assert results_of_two_policies.rates() == {
        ("listener", "explicit"): 1.0,
        ("listener", "direct"): 1.0,
        ("listener", "direct (resolved)"): 1.0,
        ("forgetful", "explicit"): 1.0,
        ("forgetful", "direct"): 0.0,
        ("forgetful", "direct (resolved)"): 0.0,
    }


def test_results_of_evaluate_are_printed_as_tables(results_of_two_policies):
    """The last is what a notebook shows."""
    results = results_of_two_policies

    assert "listener" in results.table(published=True)
    assert results.table("main", "latex").startswith("% needs")
    assert results._repr_markdown_().startswith("### Success by task and setting")


def test_results_of_evaluate_compare_two_policies_in_words(results_of_two_policies):
    compared = results_of_two_policies.compare("listener", "forgetful")
    assert "direct: no clear difference, +100.0 points" in compared


def test_an_interactive_session_shows_rates(results_of_two_policies):
    assert "forgetful explicit: 100.0 %" in repr(results_of_two_policies)


def test_a_comparison_with_a_policy_that_has_no_results_is_refused(results_of_two_policies):
    with pytest.raises(UnknownNameError):
        results_of_two_policies.compare("listener", "nobody")


def test_episodes_that_a_run_planned_and_lost_are_missing_in_its_results(
    results_of_two_policies, tmp_path
):
    """The last two of 18 records."""
    *lines, _, _ = (tmp_path / RECORDS_FILE).read_text().splitlines(keepends=True)
    (tmp_path / RECORDS_FILE).write_text("".join(lines))

    results = Results(tmp_path)

    assert (len(results.frame), results.errors, results.missing) == (16, 0, 2)


def test_results_of_evaluate_are_drawn_with_published_ones_and_saved(
    results_of_two_policies, tmp_path
):
    """MemER is a policy of which results are published."""
    results_of_two_policies.plot("gaps", published=True).save(tmp_path / "a.svg")

    assert "<!-- MemER -->" in (tmp_path / "a.svg").read_text()


def test_a_notebook_shows_a_plot_as_a_picture(results_of_two_policies):
    assert results_of_two_policies.plot("gaps")._repr_png_().startswith(b"\x89PNG")


def test_a_plot_of_results_that_the_run_does_not_have_is_refused(results_of_two_policies):
    with pytest.raises(InvalidValueError, match="nothing to draw for 'context'"):
        results_of_two_policies.plot("context")


def test_results_of_evaluate_are_written_as_a_page(results_of_two_policies):
    assert results_of_two_policies.report().read_text().startswith("<!doctype html>")


def test_evaluate_goes_on_in_the_folder_it_is_given(episodes_decided_by_setting, tmp_path):
    """Three episodes in explicit, then in all five settings: 15 records, none twice."""
    roboirg.evaluate("oracle", settings="explicit", out=tmp_path, **THREE_EPISODES)
    roboirg.evaluate("oracle", settings="all", out=tmp_path, **THREE_EPISODES)

    assert len(read_records(tmp_path)) == 3 * 5


def test_evaluate_makes_a_new_folder_if_it_is_given_none(
    episodes_decided_by_setting, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)

    first = roboirg.evaluate("oracle", settings="explicit", **THREE_EPISODES)
    second = roboirg.evaluate("oracle", settings="explicit", **THREE_EPISODES)

    assert first.folder.parent == second.folder.parent == tmp_path / "runs"
    assert first.folder != second.folder


def test_a_policy_given_as_class_or_object_plays_in_this_process_with_a_warning(
    episodes_decided_by_setting, tmp_path, capsys
):
    options = {**THREE_EPISODES, "out": tmp_path, "progress": True}

    results = roboirg.evaluate({"mine": Still(), "class": Still}, **options)

    assert {record.policy for record in results.records} == {"mine", "class"}
    assert read_plan(tmp_path).hosting.policy_process == "shared"
    assert "No other process has mine: all episodes are played in this one" in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize(
    ("policy", "workers", "reason"),
    [
        (Still(), 2, "exists in this process only"),
        ([Still(), Still], 0, "same name"),
        (object(), 0, "has no method"),
    ],
    ids=["several workers", "two of one name", "no policy"],
)
def test_a_policy_given_as_class_or_object_that_cannot_be_played_is_refused(
    tmp_path, policy, workers, reason
):
    with pytest.raises(InvalidValueError, match=reason):
        roboirg.evaluate(policy, out=tmp_path, **{**THREE_EPISODES, "workers": workers})


class StillWithAttach(Still):
    def attach(self, env):
        pass


@pytest.mark.parametrize("policy", [StillWithAttach(), f"{__name__}:StillWithAttach"])
def test_a_policy_that_takes_the_world_is_refused_unless_declared_privileged(tmp_path, policy):
    """It has a method attach(env). Would find a policy that knows the goal without a mark."""
    with pytest.raises(InvalidValueError, match=r"has attach\(\).*roboirg\.Privileged\(policy\)"):
        roboirg.evaluate(policy, out=tmp_path, policy_process="shared", **THREE_EPISODES)


@pytest.mark.parametrize("policy", [StillWithAttach(), f"{__name__}:StillWithAttach"])
def test_records_mark_a_policy_that_is_declared_privileged(
    episodes_decided_by_setting, tmp_path, policy
):
    results = roboirg.evaluate(
        roboirg.Privileged(policy), out=tmp_path, policy_process="shared", **THREE_EPISODES
    )
    assert {record.privileged for record in results.records} == {True}


def test_a_class_that_can_be_imported_gets_its_own_process():
    policy = policy_of(RandomPolicy)

    assert policy.spec == "roboirg.policies.builtin.random_policy:RandomPolicy"
    assert policy.place == "own"


def test_objects_and_classes_that_no_other_process_can_import_stay_in_this_one(monkeypatch):
    """Such classes are those made in a function and those of the script (`__main__`)."""
    of_script = type("OfScript", (Still,), {"__module__": "__main__"})
    monkeypatch.setattr(sys.modules["__main__"], "OfScript", of_script, raising=False)
    made_here = type("Made", (Still,), {})

    for policy in (RandomPolicy(seed=1), made_here, of_script):
        assert policy_of(policy).place == "python", policy


def test_evaluate_takes_the_options_of_a_plan():
    """Episode 2, two seeds, two lists of stages and a step limit arrive in the plan as given."""
    plan = python_run.python_plan(
        "oracle", tasks=["PickXtimes"], settings="contextual", episodes=[2],
        policy_seeds=(7, 42), stages=[(1, 5), (1, 2, 5)], max_steps=600, wordings=None,
    )  # fmt: skip

    assert (plan.episodes, plan.policy_seeds, plan.environment.max_steps) == ((2,), (7, 42), 600)
    assert plan.stages == ((1, 5), (1, 2, 5))


@pytest.mark.parametrize(
    ("option", "words"),
    [({"tasks": "PickXtime"}, "PickXtimes"), ({"max_stps": 3}, r"max_stps.*mean 'max_steps'")],
)
def test_evaluate_refuses_unknown_names_with_the_nearest(option, words):
    with pytest.raises(UnknownNameError, match=words):
        roboirg.evaluate("oracle", **{**THREE_EPISODES, **option})


@pytest.mark.parametrize("workers", ["2", True, 2.0])
def test_evaluate_refuses_a_number_of_workers_that_is_no_whole_number(workers):
    with pytest.raises(InvalidValueError, match=f"workers is {workers!r}; it must be a whole"):
        roboirg.evaluate("oracle", **{**THREE_EPISODES, "workers": workers})


@pytest.mark.parametrize("name", [5, True, "", " ", "runs/\0"])
@pytest.mark.parametrize("use", [Results, lambda name: roboirg.evaluate("oracle", out=name)])
def test_an_output_folder_that_is_no_path_is_refused_and_nothing_is_written(
    tmp_path, monkeypatch, use, name
):
    monkeypatch.chdir(tmp_path)

    with pytest.raises(InvalidValueError, match=r"The run's folder is .*; it must be a path"):
        use(name)

    assert not list(tmp_path.iterdir())


def test_without_pandas_results_lack_only_their_frame(
    episodes_decided_by_setting, tmp_path, monkeypatch
):
    results = roboirg.evaluate("oracle", out=tmp_path, **THREE_EPISODES)
    monkeypatch.setitem(sys.modules, "pandas", None)

    with pytest.raises(MissingDependencyError, match="needs pandas"):
        _ = results.frame
    assert Results(tmp_path).rates()["oracle", "explicit"] == 1.0


def test_results_of_a_path_and_of_its_text_are_equal(results_of_two_policies, tmp_path):
    assert Results(str(tmp_path)) == Results(tmp_path)


@pytest.mark.sim
def test_a_policy_object_hears_the_instructions_of_its_episodes(tmp_path):
    """In simulation. The first instruction is made up, to open the policy before the run."""
    policy = Still()

    results = roboirg.evaluate(
        policy, tasks="PickXtimes", settings="explicit,direct", episodes=1, max_steps=32,
        out=tmp_path, progress=False,
    )  # fmt: skip

    opened, *heard = policy.instructions
    assert opened == "Put the red cube on the target."
    assert heard == [
        " ".join(turn.text for turn in record.instruction) for record in results.records
    ]
