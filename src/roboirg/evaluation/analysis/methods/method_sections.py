"""The sections of a methods section: the items that audits of language evaluations ask for.

Each item is always there; what is not known is reported as not reported.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.core.plain_text import counted
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.evaluation.analysis.methods.played_facts import (
    DECLARABLE,
    NOT_REPORTED,
    PlayedFacts,
    read_facts,
)
from roboirg.evaluation.analysis.stats.cells import PolicyRun
from roboirg.evaluation.analysis.stats.chance import chance_level
from roboirg.evaluation.analysis.stats.intervals import DRAWS
from roboirg.evaluation.analysis.stats.option_labels import (
    options_label,
    options_sort_key,
    words_label,
)
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL, ScopeKey
from roboirg.evaluation.analysis.stats.sensitivity import gap_contrasts, try_choices
from roboirg.evaluation.records.record import Job, Record, Summary
from roboirg.evaluation.records.store import iterate_records, read_results
from roboirg.language import settings_of
from roboirg.language.settings import EXPLICIT
from roboirg.tasks import all_tasks, every_task
from roboirg.tasks.splits.splits import shipped_splits, slot_key
from roboirg.util.media import CONTROL_RATE

MEASURED = {"dtype": "dtypes", "device": "devices", "libraries": "libraries", "python": "python"}
"""What a policy may declare, and the field of its process's own report."""


class MethodItem(NamedTuple):
    """One item of a section: what it is about, and what is known."""

    label: str
    text: str


Items = Iterator[MethodItem]


class Section(NamedTuple):
    """A heading with its facts."""

    title: str
    facts: tuple[MethodItem, ...]


def make_sections(folder: Path, planned: Sequence[Job]) -> tuple[Section, ...]:
    """Return the methods section of a run.

    Args:
        folder: of the run.
        planned: jobs of its plan.

    Raises:
        StoreError: the folder holds no run.
    """
    results = read_results(folder)
    data = RunData.of([(str(folder), results)], planned)
    played = read_facts(_newest(folder, results))
    jobs = planned or [one.identity for one in results]
    return (
        Section("Horizon and control rate", tuple(_horizon(results, played))),
        Section("Precision of inference", tuple(_precision(results, played))),
        Section("Observations", tuple(_observations(results, played))),
        Section("Instructions", tuple(_instructions(results, played))),
        Section("Use of the words in training", tuple(_training(played))),
        Section("Screening of scenes", tuple(_screening(jobs))),
        Section("Statistics", tuple(_statistics(data))),
        Section("Sensitivity to analysis choices", tuple(_sensitivity(data))),
        Section("Controls and floors", tuple(_controls(data, jobs))),
        Section("Seeds, retries and errors", tuple(_errors(results, data, played))),
    )


def _newest(folder: Path, results: Iterable[Summary]) -> Iterator[Record]:
    """Yield the records behind results, without those that were played again."""
    kept = {(one.slug, one.started_at) for one in results}
    return (one for one in iterate_records(folder) if (one.slug, one.started_at) in kept)


def _distinct(values: Iterable[object]) -> str:
    found = sorted({str(one) for one in values if one is not None})
    return ", ".join(found) or NOT_REPORTED


def _horizon(results: Sequence[Summary], played: Mapping[str, PlayedFacts]) -> Items:
    yield MethodItem("step limit", f"{_distinct(one.max_steps for one in results)} control steps")
    yield MethodItem("control rate", f"{CONTROL_RATE} steps a second")
    for name, facts in played.items():
        each = f"{facts.steps / facts.calls:.1f}" if facts.calls else NOT_REPORTED
        yield MethodItem(
            name,
            f"action space {facts.need('actions')}; steps executed per call, mean: {each}; "
            f"further observations during a call's steps, every n-th: "
            f"{facts.need('observe_every')}",
        )


def _precision(results: Sequence[Summary], played: Mapping[str, PlayedFacts]) -> Items:
    for name, facts in played.items():
        known = {DECLARABLE[key]: _either(facts, key, name) for key, name in MEASURED.items()}
        where = "computed by a server; " if facts.is_remote else ""
        yield MethodItem(name, where + "; ".join(f"{key}: {value}" for key, value in known.items()))
    yield MethodItem("roboirg", _distinct(one.package_version for one in results))
    yield MethodItem("physics computed on", _distinct(one.processor for one in results))


def _either(facts: PlayedFacts, key: str, name: str) -> str:
    """Return what the policy declares, or else what its process reported."""
    said = facts.said(key)
    return facts.measured(name) if said == NOT_REPORTED else said


def _observations(results: Sequence[Summary], played: Mapping[str, PlayedFacts]) -> Items:
    blind = all(facts.need("cameras") == "none" for facts in played.values())
    devices = _distinct(one.render_device for one in results)
    drawn = "not rendered, as no policy has a camera" if blind else f"rendered on {devices}"
    yield MethodItem(
        "source",
        f"simulated, environment version {_distinct(one.environment_version for one in results)}, "
        f"{_distinct(one.meshes for one in results)} meshes, {drawn}",
    )
    for name, facts in played.items():
        cameras = facts.need("cameras")
        size = "" if cameras == "none" else ", 256 × 256 pixels"
        yield MethodItem(
            name,
            f"cameras: {cameras}{size}, depth: {facts.need('depth')}; "
            f"frames of the video: {facts.need('demonstration_frames')}; "
            f"{DECLARABLE['preprocessing']}: {facts.said('preprocessing')}",
        )


def _instructions(results: Sequence[Summary], played: Mapping[str, PlayedFacts]) -> Items:
    yield MethodItem("language version", _distinct(one.language_version for one in results))
    for wordings in sorted({one.options.wordings for one in results}, key=str):
        splits = sorted({one.split for one in results if one.options.wordings == wordings})
        listed = ", ".join(_pool_words(split, wordings) for split in splits)
        yield MethodItem("words", f"{words_label(wordings)}, {listed}")
    yield MethodItem(
        "overlap of pools",
        "templates of the two pools are disjoint: no instruction of the test split occurs in train "
        "or val",
    )
    for setting in dict.fromkeys(one.setting for one in results):
        texts = set().union(*(facts.texts.get(setting, set()) for facts in played.values()))
        yield MethodItem(setting, counted(len(texts), "distinct instruction"))
    yield MethodItem("delivery", _distinct(one.options.delivery for one in results))
    lowered = {"yes": "sent in lower case", "no": "sent as written"}
    for name, facts in played.items():
        own = Counter(one.prompt_verdict for one in results if one.policy == name)
        unknown = own.total() - own["heard"] - own["cut"]
        yield MethodItem(
            name,
            f"{lowered.get(facts.need('lowers_prompt'), NOT_REPORTED)}; "
            f"{DECLARABLE['text_normalization']}: {facts.said('text_normalization')}; "
            f"limit of tokens, as declared: {facts.need('prompt_tokens')}; "
            f"heard whole {own['heard']}, cut {own['cut']}, unknown {unknown}",
        )


def _pool_words(split: str, wordings: str | None) -> str:
    if wordings is None or wordings in POOLS:
        return f"{split} split in words of the {pool_of(split, wordings)} pool"
    return f"{split} split"


def _training(played: Mapping[str, PlayedFacts]) -> Items:
    for name, facts in played.items():
        yield MethodItem(name, f"{DECLARABLE['trained_on']}: {facts.said('trained_on')}")


def _screening(jobs: Sequence[Job]) -> Items:
    scenes = {(one.task, one.split, one.episode) for one in jobs}
    numbers = [one[2] for one in scenes]
    yield MethodItem(
        "scenes",
        f"{len(scenes)}, of {counted(len({one[0] for one in scenes}), 'task')}, split "
        f"{_distinct(one[1] for one in scenes)}, chosen by number ({min(numbers)} to "
        f"{max(numbers)}); none was left out after it was played",
    )
    yield MethodItem(
        "seeds that were passed over when these scenes were sampled",
        f"{sum(map(_passed_over, scenes))}: no room for an object, a setting that cannot express "
        "the scene, or not solved by the oracle; published scenes have none",
    )
    absent = [name for name in all_tasks() if name not in {one[0] for one in scenes}]
    yield MethodItem("tasks that were not played", ", ".join(absent) or "none")
    by_setting: dict[str, set[tuple[str, str, int]]] = defaultdict(set)
    for one in jobs:
        by_setting[one.setting].add((one.task, one.split, one.episode))
    for setting, own in by_setting.items():
        has = [task for task in {one[0] for one in scenes} if _has_setting(task, setting)]
        possible = sum(one[0] in has for one in scenes)
        yield MethodItem(
            setting,
            f"{len(own)} of {possible} scenes of {counted(len(has), 'task')}; "
            f"{possible - len(own)} refused, because the setting cannot express them",
        )


def _passed_over(scene: tuple[str, str, int]) -> int:
    task, split, number = scene
    found = shipped_splits().get(task)
    return found.passed_over.get(slot_key(split, number), 0) if found else 0


def _has_setting(task: str, setting: str) -> bool:
    found = every_task().get(task)
    return found is None or setting in settings_of(found)


def _statistics(data: RunData) -> Items:
    seeds = len({one.policy_seed for _, one in data.results})
    yield MethodItem("unit", "the episode; all policy seeds of an episode are one unit")
    single = "Wilson's score for single cells, for averages" if seeds == 1 else "for all rates"
    yield MethodItem("intervals", f"95 %; {single} the bootstrap over episodes ({DRAWS} resamples)")
    yield MethodItem(
        "gaps",
        "paired by episode, two-sided, signed; exact sign-flip test"
        + (" (McNemar's exact test)" if seeds == 1 else ""),
    )
    yield MethodItem("multiplicity", "Holm's correction over what is read together")
    yield MethodItem("averages", "unweighted means over tasks")


def _sensitivity(data: RunData) -> Items:
    for policy_run, name in data.names.items():
        own = [one for owner, one in data.results if owner == policy_run]
        tried = try_choices(gap_contrasts(own))
        if not tried:
            yield MethodItem(name, f"{NOT_REPORTED}: no setting was played next to explicit")
        for found in tried:
            verdict = {"open": "no clear gap to explicit"}.get(
                found.verdict, f"{found.verdict} than explicit"
            )
            how = found.sentence if found.others else "no other choice applies"
            yield MethodItem(f"{name}, {found.label}", f"{verdict}; {how}")


def _controls(data: RunData, jobs: Sequence[Job]) -> Items:
    by_options = defaultdict(list)
    for job in jobs:
        by_options[job.column].append(job)
    for options in sorted(by_options, key=options_sort_key):
        level = chance_level(by_options[options])
        text = NOT_REPORTED if level is None else f"{100 * float(level):.1f} %"
        yield MethodItem(
            f"chance in {options_label(options)}", f"{text}, given the final command alone"
        )
    controls = [one for one in data.names if one.is_privileged]
    listed = [f"{data.names[one]}: {_rates(data, one)}" for one in controls]
    yield MethodItem("privileged policies as controls", "; ".join(listed) or "none")
    arms = Counter(job.arm for job in jobs)
    listed = [f"{arm} {counted(count, 'episode')}" for arm, count in arms.items()]
    yield MethodItem("arms, without what has no such arm", ", ".join(listed))
    forms = sorted({one.form for one in jobs if one.setting != EXPLICIT})
    yield MethodItem("forms of the implicit settings", ", ".join(forms) or "none")


def _rates(data: RunData, policy_run: PolicyRun) -> str:
    found = []
    for options in sorted({key.options for key in data.cells}, key=options_sort_key):
        row = data.summaries.get(ScopeKey(policy_run, ALL, options))
        if row is not None and row.rate is not None:
            found.append(f"{options_label(options)} {100 * float(row.rate):.1f} %")
    return ", ".join(found)


def _errors(results: Sequence[Summary], data: RunData, played: Mapping[str, PlayedFacts]) -> Items:
    seeds = _distinct(one.policy_seed for one in results)
    yield MethodItem("policy seeds", f"{seeds}; a policy's seed is derived from it and the episode")
    again = sum(
        count for one in played.values() for number, count in one.attempts.items() if number > 1
    )
    yield MethodItem("episodes that were begun more than once", f"{again} of {len(results)}")
    kinds = Counter(one.error for one in results if one.outcome == "error")
    listed = ", ".join(f"{kind}: {count}" for kind, count in kinds.items())
    yield MethodItem("errors, in no rate", f"{listed or 'none'} (of {len(results)} results)")
    missing = sum(cell.missing for cell in data.cells.values())
    yield MethodItem("planned and not played", str(missing))
