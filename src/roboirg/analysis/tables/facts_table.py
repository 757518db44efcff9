"""Table of the facts of a run that a methods section needs; what is unknown is *not reported*."""

from __future__ import annotations

import operator
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.option_labels import options_sort_key
from roboirg.analysis.tables.table import Column, Row, Table
from roboirg.core.instruction_options import options_label
from roboirg.core.word_pools import words_label
from roboirg.policies.contract.policy_calls import SERVER
from roboirg.records.record import Record, Summary
from roboirg.stats.rates import half_up
from roboirg.util.media import CONTROL_RATE

RUN = "the run"
NOT_REPORTED = "not reported"
NO_NETWORK = "not applicable, as there is no neural network"

Facts = Iterator[tuple[str, Iterable[object]]]
"""Names of facts, each with all its values; None is unknown."""

_OF_RUN = {
    "environment version": "environment_version",
    "language version": "language_version",
    "package version": "package_version",
    "package code": "code",
    "verdict code": "verdict_code",
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


class _FactSheet:
    """The facts of the run, or of a policy.

    Attributes:
        words: by name of a fact its values in words, each once, in the order of the records.
        calls: numbers of steps and calls, and the most actions executed per call.
    """

    def __init__(self) -> None:
        self.words: defaultdict[str, dict[str, None]] = defaultdict(dict)
        self.calls: Counter[str] = Counter()

    def add(self, facts: Facts) -> None:
        for name, values in facts:
            for value in values:
                self.words[name] |= dict.fromkeys(_words(value))

    def rows(self, owner: str) -> list[Row]:
        rows = []
        for name, words in self.words.items():
            rows.append(Row(owner, name, ["; ".join(words) or NOT_REPORTED]))
        return rows


def make_facts_table(data: RunData) -> Table:
    """Make the table of what a paper's methods section needs to name: versions, seeds, devices.

    Its first rows are about the run, then come those about each policy. What needs more than
    results, such as numbers of steps, is read from the whole records.
    """
    results = data.frame.played
    run = _FactSheet()
    run.add(_run_conditions(results))
    run.add(_run_counts(results, data))
    policies: defaultdict[str, _FactSheet] = defaultdict(_FactSheet)
    for record in _last_played(data.records, results):
        policy = policies[record.policy]
        policy.add(_of_policy(record))
        policy.calls.update(steps=record.steps, calls=record.calls)
        policy.calls["executed"] = max(policy.calls["executed"], record.executed)

    rows = run.rows(RUN)
    for name, policy in policies.items():
        policy.add(_of_calls(policy.calls))
        rows += policy.rows(name)
    return Table(
        key="facts",
        title="Facts of the run",
        heads=("of", "fact"),
        columns=(Column("value", is_text=True),),
        rows=rows,
    )


def _last_played(records: Iterable[Record], results: Iterable[Summary]) -> Iterator[Record]:
    """Yield the records that are behind results; others are of episodes that were played again."""
    played = {(result.slug, result.started_at) for result in results}
    for record in records:
        if (record.slug, record.started_at) in played:
            yield record


def _of_calls(calls: Counter[str]) -> Facts:
    """Yield facts on how often a policy was called, and how many actions of a call were executed.

    Args:
        calls: numbers of control ``steps`` and ``calls``, and the most actions ``executed``.
    """
    steps_per_call = None
    if calls["calls"]:
        steps_per_call = half_up(calls["steps"] / calls["calls"], 1)
    yield "control steps per call, mean", [steps_per_call]
    yield "actions executed per call, most", [calls["executed"] or None]


def _run_conditions(results: Sequence[Summary]) -> Facts:
    """Yield the facts that all policies share, each with the values of all results.

    They are versions, conditions such as the step limit, and settings of instructions.
    """
    for name, field in _OF_RUN.items():
        yield name, map(operator.attrgetter(field), results)
    step_limits = [result.environment.max_steps for result in results]
    yield "step limit", [f"{steps} at {CONTROL_RATE} a second" for steps in step_limits]
    columns = {result.column for result in results}
    yield "settings", map(options_label, sorted(columns, key=options_sort_key))
    yield "words", [words_label(result.options.wordings) for result in results]
    yield "delivery", [result.options.delivery for result in results]


def _run_counts(results: Sequence[Summary], data: RunData) -> Facts:
    """Yield facts that count: episodes, policy seeds, and trials that were played, failed, missing.

    A trial is an episode with a policy seed.
    """
    episodes = {result.episode for result in results}
    yield "episodes", [f"{len(episodes)}, from {min(episodes)} to {max(episodes)}"]
    policy_seeds = {result.policy_seed for result in results}
    yield "policy seeds", sorted(policy_seeds)
    yield "trials played", [len(results)]
    errors = Counter(result.error for result in results if result.outcome == "error")
    yield "errors, in no rate", [errors or 0]
    missing = sum(cell.missing for cell in data.cells.values())
    yield "trials planned and not played", [missing]
    begun_again = sum(result.attempt > 1 for result in results)
    yield "trials begun again", [begun_again]


def _of_policy(record: Record) -> Facts:
    """Yield what the record of an episode holds about its policy: version, needs, declarations.

    What it does not hold is None, which the table prints as *not reported*.
    """
    version = record.server_version or record.policy_version
    yield "version", [_unless_unknown(version)]
    yield "reads the simulator's state", [record.privileged]
    # If a record lists any needs, what it does not list is not needed; else nothing is known.
    not_listed: object = [] if record.needs else None
    for name in _NEEDS:
        yield name.replace("_", " "), [record.needs.get(name, not_listed)]
    declared = _declared(record)
    for name in _DECLARED:
        yield name.replace("_", " "), [declared.get(name)]
    yield "prompts", [_unless_unknown(record.prompt_verdict)]


def _unless_unknown(word: str) -> str | None:
    return None if word == "unknown" else word


def _declared(record: Record) -> dict[str, object]:
    """Return what is known of a policy's software, by the keys of its metadata, such as ``dtype``.

    It is what the policy declares, or else what was measured of the process in which it played.
    Keys that only networks have are *not applicable* to a policy without a network.
    """
    metadata = _metadata(record)
    declared: dict[str, object] = {}
    if metadata.get("network") == "none":
        declared |= dict.fromkeys(_OF_NETWORKS, NO_NETWORK)
    inference = record.inference
    # Measured is the process that played, which is not that of a policy server.
    if inference is not None and SERVER not in metadata:
        measured = {
            "python": inference.python,
            "libraries": inference.libraries,
            "parameter_dtype": inference.dtypes,
            "device": inference.devices,
        }
        for name, value in measured.items():
            if value:
                declared[name] = value
    return declared | metadata  # what is declared holds, also if something else was measured


def _metadata(record: Record) -> dict[str, Any]:
    """Return what a policy declares about itself.

    If it is a planner that directs another policy, this includes what that one declares; where both
    have the same key, the planner's value counts.
    """
    metadata = record.policy_metadata
    behind_planner = metadata.get("policy")
    if not isinstance(behind_planner, Mapping):
        return dict(metadata)
    of_directed = dict(behind_planner)
    of_directed.pop("network", None)  # says nothing about the planner's
    return {**of_directed, **metadata}


def _words(value: object) -> list[str]:
    """Return the value of a fact as texts to print; none if it is unknown.

    For example ``["yes"]`` for True, ``["front, wrist"]`` for a list of two cameras, and
    ``["numpy 2.1", "torch 2.6"]`` for a mapping.
    """
    if value in (None, ""):
        return []
    if isinstance(value, Mapping):
        return [f"{key} {part}" for key, part in value.items()]
    if isinstance(value, list | tuple):
        return [", ".join(map(str, value)) or "none"]
    if isinstance(value, bool):
        return ["yes" if value else "no"]
    return [str(value)]
