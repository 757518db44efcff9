"""A name stands for one policy: what it is, is compared in folders, tables and merges alike."""

from __future__ import annotations

import dataclasses
import functools
import re
import typing
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import pytest
from evaluation_fakes import FakePlay, small_plan
from msgspec.structs import replace
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.versions import POLICY
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.records.merging import merge_runs
from roboirg.evaluation.records.mixing import mixtures
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore, read_results
from roboirg.evaluation.run.runner import check_run
from roboirg.policies import vlm
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.builtin.random_policy import RandomPolicy
from roboirg.policies.by_name.finding import Privileged, make_policy, policy_of, read_policy
from roboirg.policies.by_name.makeup import makeup_of
from roboirg.policies.by_name.policy_classes import url_classes
from roboirg.policies.by_name.policy_kinds import split_spec
from roboirg.policies.contract.option_checking import NOT_COMPARED
from roboirg.policies.planners import OF_MODELS, PLANNERS, make_planner
from roboirg.policies.vlm.vlm_listener import ListenerOptions

NAME = "random"
"""Of all policies here, as the fake plan has it."""


def named(spec: str) -> PolicyRef:
    """Return a policy as a plan has it, but for what is made of it; needs no library."""
    ref = split_spec(NAME, spec)
    return dataclasses.replace(ref, version="7", makeup=makeup_of(ref))


@functools.cache
def played() -> tuple[Record, Record]:
    first, second, *_ = map(FakePlay(), small_plan(2).jobs())
    return first, second


def store(folder: Path, *records: Record) -> None:
    with RecordStore(folder) as opened:
        for record in records:
            opened.append(record)


def is_refused(action: typing.Callable[[], object]) -> str:
    try:
        action()
    except StoreError as error:
        return str(error)
    return ""


class Seen(typing.NamedTuple):
    """What is said where results of two policies of one name meet; empty if they are one."""

    stored: str
    resumed: str
    merged: str
    labels: str
    mixed: str


def meet(folder: Path, before: PolicyRef, now: PolicyRef) -> Seen:
    folder = folder / f"{len(list(folder.iterdir()))}"
    one, two = (
        replace(record, ref=ref) for record, ref in zip(played(), (before, now), strict=True)
    )
    store(folder / "a", one)
    store(folder / "b", two)
    plan = small_plan(2).model_copy(update={"policies": (now,)})
    resumed = is_refused(lambda: check_run(plan, folder / "a"))
    merged = is_refused(lambda: merge_runs([folder / "b", folder / "a"], folder / "out"))
    stored = is_refused(lambda: store(folder / "a", two))
    labels = list(make_frame([("a", [one]), ("b", [two])]).names.values())
    return Seen(
        stored=stored.replace(str(folder), "."),
        resumed=resumed.replace(str(folder), "."),
        merged=merged.replace(str(folder), "."),
        labels="; ".join(labels) if len(labels) > 1 else "",
        mixed=" ".join(mixtures([one, two])),
    )


OPENPI = "openpi://gpu:8000"
MME = "mme-vla://gpu:8000"
OTHERS = [
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
    ("system:pi0.5", "system:pi0.5?policy.execute=4"),
    ("lerobot://lab/one", "lerobot://lab/two"),
    ("trained:a.pt", "trained:a.pt?actions=joint_angle"),
    ("trained:a.pt", "learned:a.pt"),
]


@pytest.mark.parametrize(("before", "now"), OTHERS)
def test_another_policy_of_the_same_name_is_refused_or_kept_apart(
    before: str, now: str, tmp_path: Path, snapshot
) -> None:
    """In one sentence with both values; tables name the difference in their labels."""
    seen = meet(tmp_path, named(before), named(now))
    assert "" not in seen
    assert seen._asdict() == snapshot


CHECKPOINT = {"config.json": "{}", "model.safetensors": "weights"}
SAME = [
    (OPENPI, "openpi://other:9/path"),
    (f"{OPENPI}?execute=8", f"{OPENPI}?execute=08&timeout=9&tls=yes"),
    (MME, f"{MME}?execute=16&history=yes&part=4"),
    ("trained:a.pt", "trained:elsewhere/a.pt?actions=waypoint"),
    ("trained:a.pt?hands=mme-vla://a:1", "trained:a.pt?hands=mme-vla://b:2"),
    ("planner:mine:Guide?hands=mme-vla://a:1", "planner:mine:Guide?hands=mme-vla://b:2"),
    ("planner:oracle?hands=scripted&subgoals=grounded", "planner:oracle"),
    ("system:pi0.5?server=b:2", f"{MME}?history=no&subgoals=none&prompt_tokens=64"),
    (
        "vlm-listener:openai?model=m&base_url=http://a:1&input_price=2",
        "vlm-listener:openai?model=m",
    ),
    ("lerobot://{first}", "lerobot://{second}"),
    ("lerobot://{first}?version=7", "lerobot://lab/two?version=7"),
    (f"{OPENPI}?tokenizer={{first}}/config.json", f"{OPENPI}?tokenizer={{second}}/config.json"),
]


@pytest.mark.parametrize(("before", "now"), SAME)
def test_a_policy_that_moved_or_is_typed_otherwise_is_the_same(
    before: str, now: str, tmp_path: Path
) -> None:
    for place in ("first", "second"):
        (tmp_path / place).mkdir()
        for name, content in CHECKPOINT.items():
            (tmp_path / place / name).write_text(content)
    places = {"first": tmp_path / "first", "second": tmp_path / "second"}
    refs = [named(spec.format(**places)) for spec in (before, now)]
    assert not any(meet(tmp_path, *refs))


def test_a_checkpoint_with_other_bytes_is_another(tmp_path: Path) -> None:
    file = tmp_path / "model.safetensors"
    (tmp_path / "config.json").write_text("{}")
    found = set()
    for content in ("weights", "other"):
        file.write_text(content)
        found.add(named(f"lerobot://{tmp_path}").makeup)
    assert len(found) == 2


OTHER_TEXTS = {
    "actions": "ee_pose",
    "asked": "every+9+steps",
    "base_url": "http://other:1",
    "prompts": "{prompts}",
}


def options_of(kind: type[BaseModel]) -> Iterator[tuple[str, FieldInfo]]:
    """Yield all options, those of a model next to the others."""
    for name, field in kind.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from options_of(field.annotation)
        else:
            yield name, field


def changed(name: str, field: FieldInfo) -> str:
    """Return another value of an option, as it may be typed."""
    if field.annotation is bool:
        return "no" if field.default else "yes"
    if typing.get_origin(field.annotation) is typing.Literal:
        return next(value for value in typing.get_args(field.annotation) if value != field.default)
    return OTHER_TEXTS.get(name, "7")


def registry() -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield a spec of each kind with options that are declared, and their type."""
    for scheme in url_classes():
        spec = f"{scheme}://nowhere:1?version=1"
        yield spec, type(make_policy(spec, 0).options)
    for kind in PLANNERS:
        given = {"model": {"model": "m"}} if kind in OF_MODELS else {}
        spec = f"planner:{kind}" + ("?model=m" if given else "")
        yield spec, type(make_planner(kind, given, spec).options)
    yield "vlm-listener:openai?model=m", ListenerOptions


@pytest.mark.parametrize(("spec", "kind"), [*registry()], ids=[spec for spec, _ in registry()])
def test_every_option_of_every_kind_is_seen_everywhere_or_nowhere(
    spec: str, kind: type[BaseModel], tmp_path: Path
) -> None:
    before = named(spec)
    target = spec.partition(":")[2].partition("?")[0].replace("openai", "listener")
    prompts = str(resources.files(vlm) / "prompts" / f"{target}.toml")
    for name, field in options_of(kind):
        if name == "provider" and spec.startswith("vlm-listener"):
            continue  # it stands in front of the options
        bare = re.sub(rf"\?{name}=\w+", "", spec)
        value = changed(name, field).format(prompts=prompts)
        now = named(f"{bare}{'&' if '?' in bare else '?'}{name}={value}")
        is_compared = NOT_COMPARED not in field.metadata
        assert {bool(text) for text in meet(tmp_path, before, now)} == {is_compared}, name


def test_every_built_in_policy_and_provider_is_one_of_its_own(tmp_path: Path) -> None:
    providers = [f"vlm-listener:{provider}?model=m" for provider in ("openai", "google")]
    made = {named(spec).makeup for spec in [*BUILTIN, *providers]}
    assert len(made) == len(BUILTIN) + 2
    assert all(meet(tmp_path, *map(named, providers)))


def test_of_a_kind_of_others_everything_that_is_typed_counts(tmp_path: Path) -> None:
    file = tmp_path / "weights"
    file.write_text("weights")
    copy = tmp_path / "copy"
    copy.write_text("weights")

    def lab(target: str, **options: str) -> PolicyRef:
        ref = PolicyRef(name=NAME, spec="lab:…", kind="lab", target=target,
                        options=tuple(options.items()))  # fmt: skip
        return dataclasses.replace(ref, makeup=makeup_of(ref))

    assert all(meet(tmp_path, lab("walk"), lab("run")))
    assert all(meet(tmp_path, lab("walk", fast="yes"), lab("walk", fast="no")))
    assert not any(meet(tmp_path, lab(str(file), a="1", b="2"), lab(str(copy), b="2", a="1")))


def test_objects_of_two_classes_are_two_policies_even_if_they_declare_one_version() -> None:
    class Mine(RandomPolicy):
        version = "7"

    class Other(Mine):
        pass

    found = [policy_of(one, NAME).makeup for one in (Mine(), Other(), Privileged(Mine()), Mine())]
    assert found[0] == found[3]
    assert len(set(found)) == 3
    assert read_policy("random").makeup == ((POLICY, "random"),)


def test_older_records_are_compared_by_what_they_have(tmp_path: Path) -> None:
    def older(spec: str) -> PolicyRef:
        return dataclasses.replace(named(spec), makeup=None)

    same, other = f"{OPENPI}?timeout=9&execute=8", f"{OPENPI}?timeout=9&execute=2"
    for refs in ((older(same), older(same)), (older(same), named(same))):
        assert not any(meet(tmp_path, *refs)[:3])
    for refs in ((older(same), older(other)), (older(same), named(other)),
                 (older("oracle"), named("forgetful"))):  # fmt: skip
        assert all(meet(tmp_path, *refs))
    folder = tmp_path / "resumed"
    store(folder, *(replace(record, ref=ref) for record, ref in zip(
        played(), (older(same), named(same)), strict=True)))  # fmt: skip
    assert len(make_frame([("run", read_results(folder))]).names) == 1


def test_a_pack_in_which_a_name_stands_for_two_policies_does_not_hold(tmp_path: Path) -> None:
    for folder, record, spec in zip("ab", played(), ("oracle", "forgetful"), strict=True):
        store(tmp_path / folder, replace(record, ref=named(spec)))
    lines = [(tmp_path / folder / "records.jsonl").read_bytes() for folder in "ab"]
    (tmp_path / "a" / "records.jsonl").write_bytes(b"".join(lines))
    findings = [
        text for check in verify_run(tmp_path / "a", sample=0).checks for text in check.findings
    ]
    assert "policy: the record says forgetful; an earlier one of random says oracle." in findings
