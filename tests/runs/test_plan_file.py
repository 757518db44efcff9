import pytest
import yaml

from roboirg.cli import run_commands
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language import STAGE_SETS
from roboirg.language.settings import all_settings
from roboirg.runs.plan.plan_file import named_plans, read_plan_file
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.plan_sections import WorkerNeeds
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.tasks import all_tasks

NAMED_PLANS_TESTED_ELSEWHERE = ("challenge", "paper", "paper-context", "standard")
"""Named plans with a test of their own, or of the package that brings them."""


def path_of_plan_file(folder, text):
    """Write ``plan.yaml`` into a folder and return its path."""
    path = folder / "plan.yaml"
    path.write_text(text)
    return str(path)


def test_the_plan_robomme_asks_for_the_words_of_robomme_which_are_not_in_this_package():
    options = read_plan_file("robomme")
    with pytest.raises(InvalidValueError, match=r"import-robomme PATH --out .* --wordings"):
        make_plan(["random"], **options)


@pytest.mark.parametrize(
    "name", sorted({*named_plans()} - {"robomme", *NAMED_PLANS_TESTED_ELSEWHERE})
)
def test_every_other_named_plan_can_be_played(name):
    options = {"policies": ["random"], **read_plan_file(name)}
    assert make_plan(**options).jobs()


def test_the_plan_challenge_plays_ten_explicit_episodes_a_task_with_1500_steps():
    """*challenge* is a plan file that the package has."""
    plan = make_plan(["random"], **read_plan_file("challenge"))

    assert (plan.split, plan.environment.max_steps) == ("test", 1500)
    assert plan.tasks == tuple(all_tasks())
    assert plan.episodes == tuple(range(10))
    assert {job.setting for job in plan.jobs()} == {"explicit"}


def test_the_plan_paper_is_the_protocol_of_the_paper():
    """50 episodes, three policy seeds, all tasks and settings, implicit and resolved."""
    plan = make_plan(["random"], **read_plan_file("paper"))

    assert plan.tasks == tuple(all_tasks())
    assert (plan.settings, plan.forms) == (("all",), ("implicit", "resolved"))
    assert plan.policy_seeds == (7, 42, 0)
    assert plan.episodes == tuple(range(50))
    assert plan.environment.max_steps == 1300


def test_the_plan_paper_context_plays_three_tasks_with_each_set_of_utterance_stages():
    jobs = make_plan(["random"], **read_plan_file("paper-context")).jobs()

    assert {job.options.stages for job in jobs} == set(STAGE_SETS)
    assert len(jobs) == 3 * 4 * 50 * 3  # tasks, sets of stages, episodes, policy seeds


def test_the_standard_protocol_plays_every_task_in_fifty_episodes():
    """*standard* is a plan file that the package has, the recommended protocol."""
    plan = make_plan(["random"], **read_plan_file("standard"))

    assert plan.tasks == tuple(all_tasks())
    assert (plan.episodes, plan.policy_seeds) == (tuple(range(50)), (0,))
    assert (plan.split, plan.forms) == ("test", ("implicit",))
    assert plan.environment.max_steps == 1300


def test_the_standard_protocol_has_every_setting_and_direct_in_turns():
    """Four of its fifty episodes are made: in turns, only direct is told, in each task."""
    jobs = make_plan(["random"], **read_plan_file("standard") | {"episodes": "4"}).jobs()

    in_turns = {(job.task, job.setting) for job in jobs if job.options.delivery == "turns"}

    assert {job.setting for job in jobs} == set(all_settings())
    assert in_turns == {(task, "direct") for task in all_tasks()}


@pytest.mark.parametrize(
    ("text", "typed"),
    [
        ("episodes: 4", {"episodes": "4"}),
        ("episodes: [7]", {"episodes": "7,"}),
        ("episodes: [easy, hard]", {"episodes": "easy,hard"}),
        ("policies: [oracle, random]", {"policies": ["oracle,random"]}),
        ("stages: [1, 5]", {"stages": "1,5"}),
        ("stages: [[1, 5], [1, 2, 5]]", {"stages": "1,5;1,2,5"}),
        ("video: off", {"video": "off"}),
        ("max_steps: 20", {"environment": {"max_steps": "20"}}),
        ("{max_steps: 20, environment: {meshes: light}}",
         {"max_steps": 20, "meshes": "light"}),
        ("actions: null", {}),
        ("retry_on: []", {"retry_on": "none"}),
        ("devices: 0", {"devices": ["0"]}),
        ("max_cost: 5e-1", {"max_cost": 0.5}),
        ("cluster: {labels: {spot: yes}}", {"cluster": {"labels": {"spot": "yes"}}}),
    ],
)  # fmt: skip
def test_a_value_in_a_plan_file_means_what_it_means_on_the_command_line(tmp_path, text, typed):
    few = {"policies": "random", "tasks": "PickXtimes"}

    read = read_plan_file(path_of_plan_file(tmp_path, text))

    assert make_plan(**few | read) == make_plan(**few | typed)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("episode: 4", r"no plan key .* 'episode'; .*Did you mean 'episodes'\?"),
        ("- oracle", r"is of type list; it must be a mapping"),
        ("", r"is of type NoneType"),
        ("tasks: [", r"is not valid YAML"),
        ("settings: &same direct\nforms: *same", r"line 2 has an alias"),
        ("policies: [mine: oracle]", r"has \{'mine': 'oracle'\} as a policy; write NAME=SPEC"),
        ("tasks: all\nsplit: val\ntasks:\n  - real", r"line 3 has the key 'tasks' again"),
    ],
)
def test_a_file_that_is_no_plan_is_refused_in_one_sentence(tmp_path, text, sentence):
    with pytest.raises(InvalidValueError, match=sentence) as caught:
        read_plan_file(path_of_plan_file(tmp_path, text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "episodes: 010", "episodes: 0x10", "episodes: 1_000", "policy_timeout_s: 1:30",
        "max_cost: .inf", "max_cost: 1_0.5", "split: 2026-01-31", "episodes: [0, 010]",
        "tasks:", "tasks:\n  - ", "max_steps: !!int '010'", "training: {seed:}",
    ],
)  # fmt: skip
def test_a_value_that_yaml_reads_otherwise_than_it_looks_is_refused_with_its_line(tmp_path, text):
    """As 010, which is 8, 1:30, which is 90, and 2026-01-31, which is a date."""
    with pytest.raises(InvalidValueError, match=r"line \d ") as caught:
        read_plan_file(path_of_plan_file(tmp_path, text), "training")
    assert "\n" not in str(caught.value)


def test_an_option_on_the_command_line_replaces_that_of_the_plan_file(tmp_path):
    """The file says 100 steps and light meshes, the command line 200 steps."""
    path = path_of_plan_file(tmp_path, "environment: {max_steps: 100, meshes: light}")

    plan = run_commands._plan(path, {"policies": ["random"], "max_steps": "200"}, ())

    assert plan.environment.max_steps == 200
    assert plan.environment.meshes == "light"


def test_an_unknown_plan_name_is_refused_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'paper-context'"):
        read_plan_file("paper-contxt")


def test_a_missing_plan_file_is_refused_as_unreadable():
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_plan_file("nowhere/plan.yaml")


@pytest.mark.parametrize("file", ["plan.json", "plan.yaml"])
@pytest.mark.parametrize(
    "options",
    [
        {"tasks": "BinFill", "episodes": "0,2", "stages": "1,5;1-5", "tries": 3},
        {"episodes": "3,", "policy_seeds": "7,42,0", "retry_on": "none"},
        {"demonstration_frames": 4, "observe_every": 2, "devices": "0,1", "video": "failures"},
        {"demonstration_frames": "none", "meshes": "light", "actions": "waypoint"},
        {"settings": "direct-rival", "delivery": "turns", "frame": "camera"},
        {"wordings": "train", "split": "random", "episodes": "5,99999", "max_steps": 60},
    ],
)
def test_a_plan_is_the_same_after_it_was_written_and_read_again(tmp_path, options, file):
    """As the plan.json that a run writes, and as YAML."""
    plan = make_plan(["random", "mine=oracle"], **{"tasks": "PickXtimes", **options})
    write_plan(plan, tmp_path)
    path_of_plan_file(tmp_path, yaml.safe_dump(plan.model_dump(mode="json")))

    read = make_plan(**read_plan_file(str(tmp_path / file)))

    assert read == plan
    assert read.fingerprint == plan.fingerprint


@pytest.mark.parametrize(
    ("rack", "changes", "slots"),
    [
        ("a", {}, 0),
        ("b", {}, 3),
        ("b", {"CPU": 3.0}, 2),
        ("b", {"GPU": 0.3}, 1),
        ("b", {"memory": 1e9}, 0),
    ],
)
def test_a_machine_takes_as_many_workers_as_its_label_and_scarcest_resource_allow(
    rack, changes, slots
):
    """Without changes there are processors for 6 workers, GPUs for 4 and memory for 3."""
    needs = WorkerNeeds(cpus=1.5, gpus=0.25, memory_gb=2.0, labels={"rack": "b"})
    resources = {"CPU": 9.0, "GPU": 1.0, "memory": 7e9, **changes}

    assert needs.slots({"Labels": {"rack": rack}, "Resources": resources}) == slots


def test_what_a_worker_needs_is_asked_of_ray_in_its_own_units():
    needs = WorkerNeeds(cpus=1.5, gpus=0.25, memory_gb=2.0)
    assert needs.options() == {"num_cpus": 1.5, "num_gpus": 0.25, "memory": 2_000_000_000}
