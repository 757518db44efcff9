"""Convert packs to schema 1, once: python scripts/convert_packs.py results/*.zip."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from roboirg.apps.leaderboard.packing import opened_run, pack_run
from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import Asker, Place, PolicyRef
from roboirg.evaluation.plan.option_parsing import name_and_spec
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.action_log import read_actions
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import encode
from roboirg.evaluation.records.run_files import keep_earlier_plan
from roboirg.policies.by_name.policy_kinds import LISTENER, split_spec, system_of
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.planners import OF_MODELS

ENVIRONMENT = ("max_steps", "actions", "demonstration_frames", "observe_every", "meshes")
WEIGHTS = ("lerobot", "trained")


def policy_ref(name: str, spec: str, version: str, *, is_privileged: bool) -> PolicyRef:
    """Return the policy of a record; its weights and server need not be here."""
    ref = split_spec(name, spec)
    system = system_of(ref)
    asks: Asker | None = "listener" if ref.kind == LISTENER else None
    if system is not None and (system.planner or {}).get("kind") in OF_MODELS:
        asks = "planner"
    place: Place = "server" if is_url(spec) else "world"
    if ref.kind in WEIGHTS and not is_privileged:
        place = "own"
    if ref.kind == "class":
        raise ValueError(f"{spec} is code of others")
    return replace(ref, place=place, asks=asks, version=version, is_privileged=is_privileged)


def converted_record(line: bytes, refs: dict[str, PolicyRef], folder: Path) -> bytes:
    """Return a record of schema 4 as one of schema 1; its actions show how many were executed."""
    old: dict[str, Any] = json.loads(line)
    if old["schema_version"] != 4:  # noqa: PLR2004
        raise ValueError(f"schema {old['schema_version']}")
    environment = {name: old.pop(name) for name in ENVIRONMENT}
    ref = policy_ref(
        old["policy"],
        old.pop("spec") or old["policy"],
        old.pop("policy_version"),
        is_privileged=old.pop("privileged"),
    )
    refs[ref.name] = ref
    log = None if old["action_log"] is None else read_actions(folder, old["action_log"])
    old["executed"] = 0 if log is None else max(map(len, log.chunks()), default=0)
    new = {**old, "environment": environment, "ref": msgspec.to_builtins(ref), "schema_version": 1}
    record = msgspec.json.decode(msgspec.json.encode(new), type=Record)
    return encode(record)


def converted_plan(text: str, refs: dict[str, PolicyRef]) -> bytes:
    """Return a plan as the present model writes it."""
    old: dict[str, Any] = json.loads(text)
    old.pop("seed_secret", None)
    options = old.pop("options")
    identity, file = options.pop("wordings"), old.pop("wordings")
    usual = InstructionOptions()
    old |= {name: value for name, value in options.items() if value != getattr(usual, name)}
    specs = map(name_and_spec, old.pop("policies"))
    policies = [
        refs.get(name) or policy_ref(name, spec, "unknown", is_privileged=False)
        for name, spec in specs
    ]
    for name in ENVIRONMENT:
        if old[name] == getattr(EnvironmentOptions(), name):
            del old[name]
    old["episodes"] = tuple(old["episodes"])
    plan = Plan.model_validate({
        **old,
        "policies": tuple(policies),
        "wordings": None if file is None else (file, identity),
    })  # fmt: skip
    return (plan.model_dump_json(indent=2) + "\n").encode()


def convert(pack: Path) -> None:
    """Replace a pack."""
    with opened_run(pack) as found, tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        shutil.copytree(found, folder)
        refs: dict[str, PolicyRef] = {}
        records = folder / "records.jsonl"
        lines = [converted_record(one, refs, folder) for one in records.read_bytes().splitlines()]
        records.write_bytes(b"".join(one + b"\n" for one in lines))
        for path in sorted((folder / "plans").glob("*.json")):
            content = converted_plan(path.read_text(encoding="utf-8"), refs)
            path.unlink()
            keep_earlier_plan(content, folder)
        pack_run(folder, pack)
    print(f"{pack}: {len(lines):,} records, {len(refs)} policies")


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        convert(Path(argument))
