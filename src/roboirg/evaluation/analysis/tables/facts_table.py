"""Table of the facts of a run that a methods section needs; what is unknown is *not reported*."""

from __future__ import annotations

import operator
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from roboirg.core.word_pools import words_label
from roboirg.evaluation.analysis.results.option_labels import (
    options_label,
    options_sort_key,
)
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.table import Column, Row, Table
from roboirg.evaluation.records.record import Record, Summary
from roboirg.policies.contract.policy_calls import SERVER
from roboirg.util.media import CONTROL_RATE

RUN = "the run"
NOT_REPORTED = "not reported"
NOT_APPLICABLE = "not applicable, as there is no neural network"

Facts = Iterator[tuple[str, Iterable[object]]]
"""Names of facts, each with all its values; None is unknown."""

_OF_RUN = {
    "environment version": "environment_version",
    "language version": "language_version",
    "package version": "package_version",
    "tasks": "task",
    "split": "split",
    "control arms": "arm",
    "meshes": "environment.meshes",
    "processor": "processor",
    "render device": "render_device",
}
"""Facts that are fields of a result."""

_NEEDS = (
    "cameras",
    "depth",
    "actions",
    "observe_every",
    "demonstration_frames",
    "prompt_tokens",
    "lowers_prompt",
)
"""What a policy declares that it needs, or the run prescribes."""

_OF_NETWORKS = ("preprocessing", "text_normalization", "dtype", "parameter_dtype")
"""Keys of a policy's ``metadata`` that do not exist without a network."""

_DECLARED = (
    "network",
    "trained_on",
    "reads_text",
    "chunk",
    "execute",
    *_OF_NETWORKS,
    "device",
    "libraries",
    "python",
)
"""Keys of a policy's ``metadata``; the last four are also reported by its own process."""


def make_facts_table(data: RunData, records: Iterable[Record]) -> Table:
    """Make the table from the whole records of the runs of `data`."""
    results = data.frame.played
    kept = {(one.slug, one.started_at) for one in results}
    known: defaultdict[tuple[str, str], dict[str, None]] = defaultdict(dict)

    def add(owner: str, name: str, *values: object) -> None:
        for value in values:
            known[owner, name] |= dict.fromkeys(_words(value))

    totals: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for record in records:
        if (record.slug, record.started_at) in kept:  # without what was played again
            for name, value in _of_policy(record):
                add(record.policy, name, value)
            total = totals[record.policy]
            total.update(steps=record.steps, calls=record.calls)
            total["executed"] = max(total["executed"], record.executed)
    for name, values in _of_run(results, data):
        add(RUN, name, *values)
    for policy, total in totals.items():
        mean = f"{total['steps'] / total['calls']:.1f}" if total["calls"] else None
        add(policy, "control steps per call, mean", mean)
        add(policy, "actions executed per call, most", total["executed"] or None)
    return Table(
        key="facts",
        title="Facts of the run",
        heads=("of", "fact"),
        columns=(Column("value", is_text=True),),
        rows=[
            Row(of, name, ["; ".join(values) or NOT_REPORTED])
            for of in (RUN, *totals)
            for (owner, name), values in known.items()
            if owner == of
        ],
    )


def _of_run(results: Sequence[Summary], data: RunData) -> Facts:
    for name, field in _OF_RUN.items():
        yield name, map(operator.attrgetter(field), results)
    yield (
        "step limit",
        (f"{one.environment.max_steps} at {CONTROL_RATE} a second" for one in results),
    )
    settings = sorted({one.column for one in results}, key=options_sort_key)
    yield "settings", map(options_label, settings)
    yield "words", (words_label(one.options.wordings) for one in results)
    yield "delivery", (one.options.delivery for one in results)
    episodes = sorted({one.episode for one in results})
    yield "episodes", [f"{len(episodes)}, from {episodes[0]} to {episodes[-1]}"]
    yield "policy seeds", sorted({one.policy_seed for one in results})
    errors = Counter(one.error for one in results if one.outcome == "error")
    yield "trials played", [len(results)]
    yield "errors, in no rate", [f"{kind} {count}" for kind, count in errors.items()] or [0]
    yield "trials planned and not played", [sum(one.missing for one in data.cells.values())]
    yield "trials begun again", [sum(one.attempt > 1 for one in results)]


def _of_policy(record: Record) -> Iterator[tuple[str, object]]:
    version = record.server_version or record.policy_version
    yield "version", None if version == "unknown" else version
    yield "reads the simulator's state", record.privileged
    for name in _NEEDS:
        yield name.replace("_", " "), record.needs.get(name, []) if record.needs else None
    declared = _metadata(record)
    found = None if SERVER in declared else record.inference  # a server's process is not asked
    if found is not None:
        measured = {
            "python": found.python,
            "libraries": found.libraries,
            "parameter_dtype": found.dtypes,
            "device": found.devices,
        }
        declared = {**{key: value for key, value in measured.items() if value}, **declared}
    if declared.get("network") == "none":
        declared = {**dict.fromkeys(_OF_NETWORKS, NOT_APPLICABLE), **declared}
    for name in _DECLARED:
        yield name.replace("_", " "), declared.get(name)
    yield "prompts", None if record.prompt_verdict == "unknown" else record.prompt_verdict


def _metadata(record: Record) -> dict[str, Any]:
    """Return a policy's metadata with those of the policy behind a planner, network excepted."""
    behind = record.policy_metadata.get("policy")
    inner = dict(behind) if isinstance(behind, Mapping) else {}
    inner.pop("network", None)  # the planner's is not known from it
    return {**inner, **record.policy_metadata}


def _words(value: object) -> list[str]:
    """Return a value in words; nothing if it is unknown."""
    if value in (None, ""):
        return []
    if isinstance(value, Mapping):
        return [f"{key} {one}" for key, one in value.items()]
    if isinstance(value, list | tuple):
        return [", ".join(map(str, value)) or "none"]
    if isinstance(value, bool):
        return ["yes" if value else "no"]
    return [str(value)]
