"""A name stands for one policy: what it is, is compared in folders, tables and merges alike."""

from __future__ import annotations

import dataclasses
import re
import typing
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path

import pytest
from made_records import fill
from msgspec.structs import replace
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from run_fakes import FakePlay, small_plan

from roboirg.analysis.results.frame import make_frame
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies import vlm
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.builtin.random_policy import RandomPolicy
from roboirg.policies.by_name import finding, policy_kinds
from roboirg.policies.by_name.finding import Privileged, make_policy, policy_of, read_policy
from roboirg.policies.by_name.policy_classes import url_classes
from roboirg.policies.contract.option_checking import NOT_COMPARED
from roboirg.policies.planners import OF_MODELS, PLANNERS, make_planner
from roboirg.policies.vlm.vlm_listener import ListenerOptions
from roboirg.records.merging import merge_runs
from roboirg.records.mixing import mixtures
from roboirg.records.record import Record
from roboirg.records.record_codec import StoreError
from roboirg.runs.run.ray_machines import MachineAgent, MachineVersions
from roboirg.runs.run.runner import check_run

TwoRecords = tuple[Record, Record]
SHARED_NAME = "random"
"""Of all policies here, as the fake plan has it."""


def policy_of_version_7(spec: str) -> PolicyRef:
    """Return a policy as a plan has it, but of one version whatever it is."""
    return dataclasses.replace(read_policy(spec, SHARED_NAME), version="7")


@pytest.fixture(scope="module")
def two_records():
    first, second, *_ = map(FakePlay(), small_plan(2).jobs())
    return first, second


def refusal(action: Callable[[], object]) -> str:
    try:
        action()
    except StoreError as error:
        return str(error)
    return ""


def what_is_said_where_they_meet(
    folder: Path, two_records: TwoRecords, before: PolicyRef, now: PolicyRef
) -> dict:
    """Return what is said where results of two policies of one name meet."""
    first = replace(two_records[0], ref=before)
    second = replace(two_records[1], ref=now)
    fill(folder / "a", first)
    fill(folder / "b", second)
    plan = small_plan(2).model_copy(update={"policies": (now,)})
    ways = {
        "resumed": lambda: check_run(plan, folder / "a"),
        "merged": lambda: merge_runs([folder / "b", folder / "a"], folder / "out"),
        "stored": lambda: fill(folder / "a", second),
    }
    said: dict = {name: refusal(way).replace(str(folder), ".") for name, way in ways.items()}
    said["labels"] = list(make_frame([("a", [first]), ("b", [second])]).names.values())
    said["mixed"] = list(mixtures([first, second]))
    return said


OPENPI = "openpi://gpu:8000"
MME = "mme-vla://gpu:8000"
PAIRS_OF_DIFFERENT_POLICIES = [
    ("oracle", "forgetful"),
    ("oracle", "mine:Policy"),
    ("mine:Policy", "mine:Other"),
    ("mine:Policy", "privileged:mine:Policy"),
    (f"{OPENPI}?execute=8", f"{OPENPI}?execute=2"),
    (f"{OPENPI}?execute=8", f"{OPENPI}?wrist=&prompt=task"),
    (OPENPI, MME),
    ("planner:listener", "planner:forgetful"),
    ("planner:listener", f"planner:listener?hands={MME}"),
    (f"planner:mine:Guide?hands={MME}%3Fexecute=4", f"planner:mine:Guide?hands={MME}%3Fexecute=8"),
    ("planner:listener?hands=mine:Hands", "planner:listener?hands=mine:Hands&subgoals=simple"),
    ("system:pi0.5", "system:pi0.5?policy.execute=4"),
    ("lerobot://lab/one", "lerobot://lab/two"),
    ("vlm-listener:openai?model=m", "vlm-listener:google?model=m"),
]


@pytest.mark.parametrize(
    ("before", "now"),
    [
        PAIRS_OF_DIFFERENT_POLICIES[0],
        PAIRS_OF_DIFFERENT_POLICIES[5],
        PAIRS_OF_DIFFERENT_POLICIES[8],
    ],
)
def test_another_policy_of_the_same_name_is_refused_or_kept_apart(
    before, now, two_records, tmp_path, snapshot
):
    """In one sentence with both values; tables name the difference in their labels."""
    assert (
        what_is_said_where_they_meet(
            tmp_path, two_records, policy_of_version_7(before), policy_of_version_7(now)
        )
        == snapshot
    )


def test_what_a_policy_is_tells_it_from_others(snapshot):
    found = [read_policy(before).versions.differences(read_policy(now).versions)
             for before, now in PAIRS_OF_DIFFERENT_POLICIES]  # fmt: skip
    lines = [[f"{what}: {first} | {second}" for what, first, second in each] for each in found]
    assert lines == snapshot


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
    refs = [read_policy(spec.format(**checkpoints)) for spec in (before, now)]
    assert refs[0].makeup == refs[1].makeup != ()


def test_a_policy_typed_in_another_way_goes_on_in_its_run_and_is_merged_without_a_word(
    two_records, tmp_path
):
    """08 is 8, and how long to wait and whether to encrypt make no other policy."""
    before = policy_of_version_7("openpi://gpu:8000?execute=8")
    now = policy_of_version_7("openpi://gpu:8000?execute=08&timeout=9&tls=yes")

    found = what_is_said_where_they_meet(tmp_path, two_records, before, now)

    assert found == {"resumed": "", "merged": "", "stored": "", "labels": ["random"], "mixed": []}


def test_a_checkpoint_folder_with_other_weights_is_another_policy(tmp_path):
    file = tmp_path / "model.safetensors"
    (tmp_path / "config.json").write_text("{}")
    found = set()

    for content in ("weights", "other"):
        file.write_text(content)
        found.add(read_policy(f"lerobot://{tmp_path}").makeup)

    assert len(found) == 2


def test_a_machine_of_a_cluster_with_another_checkpoint_at_the_path_is_refused(tmp_path):
    file = tmp_path / "config.json"
    file.write_text("{}")
    versions = MachineVersions((read_policy(f"lerobot://{tmp_path}"),))
    agent = MachineAgent(tmp_path / "agent", None)

    assert agent.check(versions).fault is None

    file.write_text('{"n_action_steps": 1}')
    assert str(agent.check(versions).fault).startswith("the policy of lerobot://")

    agent.close()


OTHER_TEXT_VALUES = {
    "actions": "ee_pose",
    "asked": "every+9+steps",
    "base_url": "http://other:1",
    "prompts": "{prompts}",
    "provider": "google",
}


def options_of(kind: type[BaseModel]) -> Iterator[tuple[str, FieldInfo]]:
    """Yield all options, those of a model next to the others."""
    for name, field in kind.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from options_of(field.annotation)
        else:
            yield name, field


def changed_value(name: str, field: FieldInfo) -> str:
    """Return another value of an option, as it may be typed."""
    if field.annotation is bool:
        return "no" if field.default else "yes"
    if typing.get_origin(field.annotation) is typing.Literal:
        return next(value for value in typing.get_args(field.annotation) if value != field.default)
    return OTHER_TEXT_VALUES.get(name, "7")


def specs_and_their_options() -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield a spec of each kind with options that are declared, and their type."""
    for scheme in url_classes():
        spec = f"{scheme}://nowhere:1?version=1"
        yield spec, type(make_policy(spec, 0).options)
    for kind in PLANNERS:
        given = {"model": {"model": "m"}} if kind in OF_MODELS else {}
        spec = f"planner:{kind}" + ("?model=m" if given else "")
        yield spec, type(make_planner(kind, given, spec).options)
    yield "vlm-listener:openai?model=m", ListenerOptions


def test_another_value_of_any_option_makes_another_policy_unless_declared_otherwise():
    """As addresses and timeouts are. Would find a new option that results could differ in."""
    for spec, kind in specs_and_their_options():
        before = read_policy(spec)
        target = spec.partition(":")[2].partition("?")[0].replace("openai", "listener")
        prompts = str(resources.files(vlm) / "prompts" / f"{target}.toml")
        for name, field in options_of(kind):
            if name == "provider" and spec.startswith("vlm-listener"):
                continue  # it stands in front of the options
            bare = re.sub(rf"\?{name}=\w+", "", spec)
            value = changed_value(name, field).format(prompts=prompts)
            now = read_policy(f"{bare}{'&' if '?' in bare else '?'}{name}={value}")
            is_compared = field.exclude is not NOT_COMPARED
            assert (before.makeup != now.makeup) == is_compared, (spec, name)


def test_no_two_built_in_policies_count_as_the_same():
    assert len({read_policy(spec).makeup for spec in BUILTIN}) == len(BUILTIN)


def test_of_a_policy_kind_of_another_package_every_typed_word_makes_another_policy(
    tmp_path, monkeypatch
):
    """But the order of options, and where a file with the same content lies."""
    for module in (finding, policy_kinds):
        monkeypatch.setattr(module, "known_kinds", lambda: {"lab": False})
    for name in ("weights", "copy"):
        (tmp_path / name).write_text("weights")
    specs = [
        "lab:walk", "lab:run", "lab:walk?fast=yes", "lab:walk?fast=no", "lab:walk?hands=left",
        f"lab:{tmp_path}/weights?a=1&b=2", f"lab:{tmp_path}/copy?b=2&a=1",
    ]  # fmt: skip

    found = [read_policy(spec).makeup for spec in specs]

    assert len({*found[:-1]}) == len(found) - 1
    assert found[-1] == found[-2]


def test_objects_of_two_classes_are_two_policies_even_if_they_declare_one_version():
    class Mine(RandomPolicy):
        version = "7"

    class Other(Mine):
        pass

    found = [
        policy_of(policy, SHARED_NAME).makeup
        for policy in (Mine(), Other(), Privileged(Mine()), Mine())
    ]

    assert found[0] == found[3]
    assert len(set(found)) == 3
