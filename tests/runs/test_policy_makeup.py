"""A name stands for one policy: what it is, is compared in folders, tables and merges alike."""

import dataclasses

import pytest
from made_records import fill
from msgspec.structs import replace
from run_fakes import FakePlay, small_plan

from roboirg.analysis.results.frame import make_frame
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.builtin.random_policy import RandomPolicy
from roboirg.policies.by_name import finding, policy_kinds
from roboirg.policies.by_name.finding import Privileged, make_policy, policy_of, read_policy
from roboirg.policies.by_name.policy_classes import url_classes
from roboirg.policies.contract.option_checking import NOT_COMPARED
from roboirg.records.merging import merge_runs
from roboirg.records.mixing import mixtures
from roboirg.records.record_codec import StoreError
from roboirg.runs.run.ray_machines import MachineAgent, MachineVersions
from roboirg.runs.run.runner import check_run

SHARED_NAME = "random"
"""Of all policies here, as the fake plan has it."""


def policy_of_version_7(spec):
    """Return a policy as a plan has it, but of one version whatever it is."""
    return dataclasses.replace(read_policy(spec, SHARED_NAME), version="7")


def refusal(action):
    try:
        action()
    except StoreError as error:
        return str(error)
    return ""


def what_is_said_where_they_meet(folder, before, now):
    """Return what is said where results of two policies of one name meet.

    In a run that goes on, a merge, a file of records, the labels of tables, and a list of mixtures.
    """
    plan = small_plan(2).model_copy(update={"policies": (now,)})
    first_job, second_job, *_ = plan.jobs()
    first = replace(FakePlay()(first_job), ref=before)
    second = replace(FakePlay()(second_job), ref=now)
    fill(folder / "a", first)
    fill(folder / "b", second)
    ways = {
        "resumed": lambda: check_run(plan, folder / "a"),
        "merged": lambda: merge_runs([folder / "b", folder / "a"], folder / "out"),
        "stored": lambda: fill(folder / "a", second),
    }
    said = {name: refusal(way).replace(str(folder), ".") for name, way in ways.items()}
    said["labels"] = list(make_frame([("a", [first]), ("b", [second])]).names.values())
    said["mixed"] = list(mixtures([first, second]))
    return said


OPENPI = "openpi://gpu:8000"
MME = "mme-vla://gpu:8000"


@pytest.mark.parametrize(
    ("before", "now"),
    [
        ("oracle", "forgetful"),
        (f"{OPENPI}?execute=8", f"{OPENPI}?wrist=&prompt=task"),
        ("planner:listener", f"planner:listener?hands={MME}"),
    ],
)
def test_another_policy_of_the_same_name_is_refused_or_kept_apart(before, now, tmp_path, snapshot):
    """Two policies have the same name and version, but are not the same. A record of each exists.

    A run that would go on, a merge and a file of records refuse them in one sentence with both
    values; tables name the difference in their labels. The stored snapshot has all of these texts.
    """
    before = policy_of_version_7(before)
    now = policy_of_version_7(now)

    assert what_is_said_where_they_meet(tmp_path, before, now) == snapshot


@pytest.mark.parametrize(
    ("before", "now", "what"),
    [
        ("mine:Policy", "mine:Other", "policy"),
        ("mine:Policy", "privileged:mine:Policy", "policy"),
        (OPENPI, MME, "policy"),
        ("lerobot://lab/one", "lerobot://lab/two", "policy"),
        (f"{OPENPI}?execute=8", f"{OPENPI}?execute=2", "option execute"),
        (
            "planner:listener?hands=mine:Hands",
            "planner:listener?hands=mine:Hands&subgoals=simple",
            "option subgoals",
        ),
        (
            f"planner:mine:Guide?hands={MME}%3Fexecute=4",
            f"planner:mine:Guide?hands={MME}%3Fexecute=8",
            "option hands",
        ),
        ("vlm-listener:openai?model=m", "vlm-listener:google?model=m", "option provider"),
    ],
)
def test_what_a_policy_is_tells_it_from_others(before, now, what):
    """`before` and `now` are two policies; `what` names the first thing in which they differ."""
    first, *_ = read_policy(before).versions.differences(read_policy(now).versions)
    assert first.what == what


def test_all_but_eleven_options_of_policies_behind_an_address_make_another_policy():
    """Policies with other options are compared as different ones, unless an option only says where
    the policy is, how it is reached, and how fast: addresses, keys, timeouts, batches, ... These
    are marked as NOT_COMPARED.

    The list is written out here so that whoever adds an option decides whether results could
    differ in it. All kinds of policies behind an address (a URL) are looked at, such as openpi://.
    """
    not_compared = set()
    for scheme in url_classes():
        options = make_policy(f"{scheme}://nowhere:1?version=1", 0).options
        for name, field in type(options).model_fields.items():
            if field.exclude is NOT_COMPARED:
                not_compared.add(name)

    assert not_compared == {
        "api_key_env", "batch", "connect", "device", "max_reply_mib", "part", "shared", "timeout",
        "tls", "version", "wait",
    }  # fmt: skip


CHECKPOINT_FILES = {"config.json": "{}", "model.safetensors": "weights"}
PAIRS_OF_EQUAL_POLICIES = [
    (OPENPI, "openpi://other:9/path"),
    (f"{OPENPI}?execute=8", f"{OPENPI}?execute=08&timeout=9&tls=yes"),
    (MME, f"{MME}?execute=16&history=yes&part=4"),
    ("planner:mine:Guide?hands=mme-vla://a:1", "planner:mine:Guide?hands=mme-vla://b:2"),
    ("planner:oracle?hands=scripted&subgoals=grounded", "planner:oracle"),
    ("planner:qwen?hands=mine:Hands&model=m",
     "planner:qwen?hands=mine:Hands&model=m&base_url=http://a:1"),
    ("system:pi0.5?server=b:2", f"{MME}?history=no&subgoals=none&prompt_tokens=64"),
    ("vlm-listener:openai?model=m&base_url=http://a:1&input_price=2",
     "vlm-listener:openai?model=m"),
    ("lerobot://{first}", "lerobot://{second}?device=cuda&batch=4"),
    ("lerobot://{first}?version=7", "lerobot://lab/two?version=7"),
    (f"{OPENPI}?tokenizer={{first}}/config.json", f"{OPENPI}?tokenizer={{second}}/config.json"),
]  # fmt: skip


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory):
    places = {name: tmp_path_factory.mktemp(name) for name in ("first", "second")}
    for place in places.values():
        for name, content in CHECKPOINT_FILES.items():
            (place / name).write_text(content)
    return places


@pytest.mark.parametrize(("before", "now"), PAIRS_OF_EQUAL_POLICIES)
def test_a_policy_at_another_address_or_typed_in_another_way_is_the_same_policy(
    before, now, checkpoints
):
    """What is compared of a policy is its makeup. `before` and `now` differ in what makes no
    difference: an address, a timeout, a value written in another way or the usual one, a folder
    with the same files. `first` and `second` are folders of checkpoints with the same content."""
    makeup_before = read_policy(before.format(**checkpoints)).makeup
    makeup_now = read_policy(now.format(**checkpoints)).makeup

    assert makeup_before == makeup_now != ()


def test_a_policy_typed_in_another_way_goes_on_in_its_run_and_is_merged_without_a_word(tmp_path):
    """08 is 8, and how long to wait and whether to encrypt make no other policy.

    Each of two records is of one of these. A run with them goes on, is merged and stores without an
    error; tables call both by one name, as nothing is mixed.
    """
    before = policy_of_version_7("openpi://gpu:8000?execute=8")
    now = policy_of_version_7("openpi://gpu:8000?execute=08&timeout=9&tls=yes")

    found = what_is_said_where_they_meet(tmp_path, before, now)

    assert found == {"resumed": "", "merged": "", "stored": "", "labels": ["random"], "mixed": []}


def test_a_checkpoint_folder_with_other_weights_is_another_policy(tmp_path):
    """What a policy is, its makeup, has a checksum of the files in its folder. The configuration
    and the path stay the same here, the weights do not."""
    (tmp_path / "config.json").write_text("{}")

    (tmp_path / "model.safetensors").write_text("weights")
    before = read_policy(f"lerobot://{tmp_path}").makeup
    (tmp_path / "model.safetensors").write_text("other weights")
    now = read_policy(f"lerobot://{tmp_path}").makeup

    assert before != now


def test_a_machine_of_a_cluster_with_another_checkpoint_at_the_path_is_refused(tmp_path):
    """`versions` are those of the machine that starts a run. A program on each other machine, the
    agent, compares them with what it finds there at the same path: at first the same checkpoint,
    then one whose configuration has changed."""
    file = tmp_path / "config.json"
    file.write_text("{}")
    versions = MachineVersions((read_policy(f"lerobot://{tmp_path}"),))
    agent = MachineAgent(tmp_path / "agent", None)

    assert agent.check(versions).fault is None

    file.write_text('{"n_action_steps": 1}')
    assert str(agent.check(versions).fault).startswith("the policy of lerobot://")

    agent.close()


def test_no_two_built_in_policies_count_as_the_same():
    """Would find two of them with the same makeup, which is what is compared of a policy."""
    assert len({read_policy(spec).makeup for spec in BUILTIN}) == len(BUILTIN)


@pytest.fixture
def kind_of_another_package(monkeypatch):
    """A kind of policies, `lab`, whose package is not here."""
    for module in (finding, policy_kinds):
        monkeypatch.setattr(module, "known_kinds", lambda: {"lab": False})


@pytest.mark.usefixtures("kind_of_another_package")
def test_of_a_policy_kind_of_another_package_every_typed_word_makes_another_policy():
    """The kind `lab` is of a package that is not installed here, so nobody can tell which of its
    options make a difference: all do."""
    specs = ["lab:walk", "lab:run", "lab:walk?fast=yes", "lab:walk?fast=no", "lab:walk?hands=left"]
    assert len({read_policy(spec).makeup for spec in specs}) == 5


@pytest.mark.usefixtures("kind_of_another_package")
def test_the_order_of_options_and_the_place_of_a_file_make_no_other_policy(tmp_path):
    """Two files have the same content. The kind `lab` is of a package that is not installed here,
    so nothing but the order of its options and the place of its file can be seen through."""
    (tmp_path / "weights").write_text("weights")
    (tmp_path / "copy").write_text("weights")

    one_way = read_policy(f"lab:{tmp_path}/weights?a=1&b=2").makeup
    other_way = read_policy(f"lab:{tmp_path}/copy?b=2&a=1").makeup

    assert one_way == other_way


def test_objects_of_two_classes_are_two_policies_even_if_they_declare_one_version():
    """Two objects of one class are the same policy, one of a subclass is another.

    So is one that is wrapped to know the state of the simulator. What is compared of a policy is
    its makeup.
    """

    class Mine(RandomPolicy):
        version = "7"

    class Other(Mine):
        pass

    mine = policy_of(Mine(), SHARED_NAME).makeup
    again = policy_of(Mine(), SHARED_NAME).makeup
    other = policy_of(Other(), SHARED_NAME).makeup
    privileged = policy_of(Privileged(Mine()), SHARED_NAME).makeup

    assert mine == again
    assert len({mine, other, privileged}) == 3
