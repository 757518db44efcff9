"""Jobs and results whose options are given among the other fields."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TypeVar

import msgspec

from roboirg.analysis.results.frame import Frame, make_frame
from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_ref import unknown_policy
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.by_name.finding import read_policy
from roboirg.records.record import Job, Summary

Stored = TypeVar("Stored", bound=Summary)


def nested(**given: object) -> dict[str, object]:
    """Return fields of a job, in which options have their places."""
    others = dict(given)
    version = others.pop("policy_version", None)
    privileged = others.pop("privileged", None)
    if version is not None or privileged is not None:
        ref = unknown_policy(str(others.get("policy", "")))
        version = ref.version if version is None else str(version)
        others["ref"] = replace(ref, version=version, is_privileged=bool(privileged))
    for name, kind in (("options", InstructionOptions), ("environment", EnvironmentOptions)):
        names = [name.name for name in fields(kind)]
        own = {name: others.pop(name) for name in names if name in others}
        others.setdefault(name, kind(**own))
    return others


def job_of(**given: object) -> Job:
    """Return a job, for one of our policies or for one of that name."""
    name = str(given["policy"])
    ref = read_policy(name) if name in BUILTIN or ":" in name else unknown_policy(name)
    return Job(**{"ref": ref, **nested(**given)})


def make_result(outcome: str = "success", episode: int = 0, **fields: object) -> Summary:
    """Return a made-up result."""
    usual = nested(**{
        "policy": "listener",
        "task": "PickXtimes",
        "split": "test",
        "seed": episode,
        "difficulty": "easy",
        "privileged": False,
        "language_version": "1",
        "words": "any@0a",
        "environment_version": 1,
        "package_version": "0",
        "started_at": "now",
        "duration_s": 0.0,
        **fields,
    })  # fmt: skip
    error = {"error": "policy"} if outcome == "error" else {}
    return Summary(outcome=outcome, episode=episode, **error, **usual)  # type: ignore[arg-type]


OUTCOMES = {"1": "success", "0": "failure", "!": "error"}


def make_results(outcomes: str, setting: str = "explicit", **fields: object) -> list[Summary]:
    """Return a result for each letter of `OUTCOMES`, none for another one."""
    return [
        make_result(OUTCOMES[letter], episode, setting=setting, **fields)
        for episode, letter in enumerate(outcomes)
        if letter in OUTCOMES
    ]


def frame_of(*results: Sequence[Summary], planned: Sequence[Job] = ()) -> Frame:
    """Return the frame of one run with all these results."""
    return make_frame([("run", [result for own in results for result in own])], planned)


def with_version(record: Stored, version: str) -> Stored:
    """Return the record of another version of its policy."""
    return msgspec.structs.replace(record, ref=replace(record.ref, version=version))
