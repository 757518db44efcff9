"""The items of a methods section on how scenes were selected and results were analyzed."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence

from roboirg.core.arms import SILENT_TEXTS, TOLD
from roboirg.core.episode import SPLITS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.methods.played_facts import (
    NOT_REPORTED,
    Items,
    PlayedFacts,
    TextColumn,
    distinct,
    item,
)
from roboirg.evaluation.analysis.stats.arm_figures import MEANING, arm_figures
from roboirg.evaluation.analysis.stats.cells import PolicyRun
from roboirg.evaluation.analysis.stats.chance import CHANCE, floor_level
from roboirg.evaluation.analysis.stats.intervals import ALPHA, DRAWS
from roboirg.evaluation.analysis.stats.option_labels import options_label, options_sort_key
from roboirg.evaluation.analysis.stats.rates import p_text, points
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL, ALL_TASKS, ScopeKey
from roboirg.evaluation.analysis.stats.sensitivity import (
    ARM_CONTRASTS,
    EXPLICIT_GAPS,
    Family,
    offers_for,
    try_choices,
)
from roboirg.evaluation.records.record import Job, Summary
from roboirg.language import settings_of
from roboirg.policies.builtin import BUILTIN
from roboirg.tasks import LEFT_OUT, all_tasks, every_task
from roboirg.tasks.splits.published_episodes import is_published
from roboirg.tasks.splits.splits import SIZES, shipped_splits

SceneName = tuple[str, str, int]
"""Task, split and number."""

_NO_REASON = f"reason for this selection: {NOT_REPORTED} by the user who chose it"
_GUESS = (
    "success expected of a policy that moves perfectly but picks at random among the goals that "
    "fit the last utterance. Where candidates were named before it, it picks only among these"
)
_ABLE = {"oracle", "listener"}
"""Built-in policies that succeed."""
_FEW_SCENES = 2
"""Of a task; over so few a bootstrap means nothing."""


def screening_items(jobs: Sequence[Job]) -> Items:
    """Yield which scenes were selected, and what was left out."""
    columns: dict[TextColumn, set[SceneName]] = defaultdict(set)
    for one in jobs:
        columns[TextColumn(one.column, one.arm)].add((one.task, one.split, one.episode))
    scenes = set().union(*columns.values())
    tasks = list(dict.fromkeys(one.task for one in jobs))
    absent = [name for name in all_tasks() if name not in tasks]
    reason = (f"not played: {', '.join(absent)}", _NO_REASON) if absent else ("all there are",)
    lacking = f"RoboMME also has {', '.join(LEFT_OUT)}, whose words hold no variable to refer to"
    yield item("tasks", ", ".join(tasks), *reason, lacking)
    splits, numbers = {split for _, split, _ in scenes}, sorted({number for *_, number in scenes})
    span = f"{numbers[0]} to {numbers[-1]}" if len(numbers) > 1 else numbers[0]
    whole = len(tasks) * sum(SIZES[split] for split in SPLITS if split in splits)
    is_whole = splits <= {*SPLITS} and len(scenes) == whole
    yield item(
        "scenes",
        f"{len(scenes)} of the {whole or 'unlimited'} that these tasks have in the split "
        f"{distinct(splits)}, numbered {span} in each task",
        "all there are" if is_whole else _NO_REASON,
        "roboirg leaves out none for its result; whether the user did is not known to it",
    )
    counts = f"counts of the {counted(len(scenes), 'scene')} above, not of the whole split"
    yield item("screening when the split was made", counts, *_rejections(scenes))
    for column, own in columns.items():
        has = {
            one: column.options.setting in settings_of(task) for one, task in every_task().items()
        }
        usable = {one for one in scenes if has.get(one[0], True)}
        is_told = column.arm == TOLD
        missing = "the setting cannot express them" if is_told else "there is no such goal or text"
        yield item(
            column.label,
            f"{len(own)} of {counted(len(scenes), 'scene')} planned",
            f"left out, as their tasks do not have the setting: {len(scenes - usable)}",
            f"left out, as {missing}: {len(usable - own)}",
        )


def _rejections(scenes: set[SceneName]) -> Iterator[str]:
    published = {one for one in scenes if is_published(*one)}
    if published:
        yield (
            f"{counted(len(published), 'scene')}: each RoboMME's published one, unchanged; roboirg "
            f"rejected no candidate for it; criteria and rejections: {NOT_REPORTED} by RoboMME"
        )
    shipped = {one for one in scenes - published if one[0] in shipped_splits() and one[1] in SPLITS}
    if shipped:
        rejected = sum(
            shipped_splits()[task].passed_over.get(f"{split}/{number}", 0)
            for task, split, number in shipped
        )
        yield (
            f"{counted(len(shipped), 'scene')} sampled by roboirg, after it rejected {rejected} in "
            "their places: no room for an object, a setting that cannot express it, or not solved "
            "by the oracle"
        )
    if others := len(scenes - published - shipped):
        yield f"{counted(others, 'scene')} sampled; how many were rejected: {NOT_REPORTED}"


def statistics_items(data: RunData, families: Sequence[Family]) -> Items:
    """Yield how rates and differences are analyzed."""
    seeds = len({one.policy_seed for _, one in data.results})
    wilson = "Wilson's score for a rate in one task, else " if seeds == 1 else ""
    test = "McNemar's exact test" if seeds == 1 else "the exact sign-flip test over scenes"
    yield "unit", "the scene; its rollouts with several policy seeds are one cluster"
    yield "averages", "means over tasks, each with the same weight"
    scenes = dict.fromkeys((one.task, one.episode) for _, one in data.results)
    sizes = Counter(task for task, _ in scenes)
    few = [f"{task} ({size})" for task, size in sizes.items() if size <= _FEW_SCENES]
    yield item(
        "intervals",
        f"95 %; {wilson}the bootstrap over each task's scenes ({DRAWS} resamples), paired for "
        "differences",
        f"disregard the bootstrap, for too few scenes, in: {', '.join(few) or 'no task'}",
    )
    yield item(
        f"{EXPLICIT_GAPS}, in arm told only",
        f"paired by scene, {test}, two-sided",
        f"verdict higher or lower than explicit if the corrected p is at most {ALPHA}; else open",
    )
    arms = [one for one in families if one.kind == ARM_CONTRASTS and one.contrasts]
    told = data.told()
    tests = Counter(
        f"{told.names[one.policy_run]}, {EXPLICIT_GAPS} in "
        + ("single tasks" if one.scope.task else "suites" if one.scope.suite else ALL_TASKS)
        for one in told.summaries.values()
        if one.gap
    )
    tests.update({f"{one.policy}, {one.kind}": len(one.contrasts) for one in arms})
    yield item(
        "Holm's correction",
        f"{counted(len(tests), 'family', 'families')}, each corrected alone",
        *(f"{family}: {counted(size, 'test')}" for family, size in tests.items()),
    )
    yield (
        "contrasts of arms, where played; paired and tested alike",
        MEANING.rstrip(".") if arms else "none, without control arms",
    )


def sensitivity_items(families: Sequence[Family]) -> Items:
    """Yield each verdict, and what other analyses make of it."""
    yield item(
        "other analyses",
        "exact test and Holm's correction are repeated; a verdict holds if it is the same again",
        "what swaps sides in the test is a scene, with equal weights one that counts by its weight",
        "with unit task a whole task, with unit rollout a single rollout",
    )
    for policy, kind, contrasts in families:
        if not contrasts:
            yield f"{policy}, {kind}", "none played"
            continue
        for found in try_choices(contrasts):
            least = 0.5 ** (found.pairs - 1)
            power = f", with which uncorrected p is at least {least:.3g}, so the verdict is open"
            yield item(
                f"{policy}, {found.label}",
                found.verdict,
                f"{counted(found.pairs, 'paired scene')}{power if least > ALPHA else ''}",
                found.sentence,
            )
        listed = [(one, ", ".join(of.label for of in one.choices)) for one in offers_for(contrasts)]
        tried = [text for one, text in listed if one.differs]
        rest = [f"{text} ({one.reason})" for one, text in listed if not one.differs]
        yield item(
            f"{policy}, other analyses of {kind}",
            f"tried: {', '.join(tried) or 'none'}",
            f"not tried: {', '.join(rest) or 'none'}",
        )


def control_items(data: RunData, jobs: Sequence[Job]) -> Items:
    """Yield chance levels, positive controls, and what the control arms show."""
    settings = sorted({job.column for job in jobs}, key=options_sort_key)
    silent = [one for one in data.names if one.conditions.arm in SILENT_TEXTS]
    for options in settings:
        level = floor_level(CHANCE, (job for job in jobs if job.column == options))
        floor = _rates(data, silent, [options]) or f"{NOT_REPORTED}, as no silent arm has a result"
        yield item(
            f"chance in {options_label(options)}",
            (NOT_REPORTED if level is None else f"{100 * float(level):.1f} %") + f", {_GUESS}",
            f"success without any words: {floor}",
        )
    told = data.told()
    floors = {one.policy for one in jobs if one.policy_spec in BUILTIN.keys() - _ABLE}
    able = [one for one in told.names if one.is_privileged and one.policy not in floors]
    listed = _rates(told, able, settings)
    if len(told.names) == 1:
        listed = f"none, as {next(iter(told.names.values()))} is the only policy"
    yield "positive control, another policy that reads the simulator's state", listed or "none"
    for one in arm_figures(data):
        sides = zip(one.contrast[1:3], one.rates, strict=True)
        rates = ", ".join(f"{side} {100 * rate:.1f} %" for side, rate in sides)
        yield item(
            f"{told.names[one.policy_run]}, {options_label(one.options)}, {one.contrast.name}",
            rates,
            f"difference {points(one.gap.value, 1)} points, corrected {p_text(one.p_holm)}",
            counted(one.gap.episodes, "scene"),
        )
    played = "played" if any(one.form == "resolved" for one in jobs) else "not played"
    yield "control with references replaced by names (form resolved)", played


def _rates(
    data: RunData, policy_runs: Iterable[PolicyRun], settings: Iterable[InstructionOptions]
) -> str:
    keys = (ScopeKey(*key) for key in itertools.product(policy_runs, [ALL], settings))
    return ", ".join(
        f"{data.names[key.policy_run]}, {options_label(key.options)}: {100 * float(row.rate):.1f} %"
        for key in keys
        if (row := data.summaries.get(key)) and row.rate is not None
    )


def error_items(
    results: Sequence[Summary], data: RunData, played: Mapping[str, PlayedFacts]
) -> Items:
    """Yield seeds, repeated rollouts, errors, and what is missing."""
    seeds = {one.policy_seed for one in results}
    yield item(
        "policy seeds",
        f"{counted(len(seeds), 'seed')}, numbered {distinct(seeds)}",
        "the seed that a policy gets is made from this number and the scene",
    )
    again = sum(one.repeated for one in played.values())
    yield "rollouts begun again after a fault", f"{again} of {len(results)}"
    kinds = Counter(one.error for one in results if one.outcome == "error")
    listed = [f"{kind} {count}" for kind, count in kinds.items()]
    count = f"{kinds.total()} of {len(results)}"
    yield item("rollouts that ended in an error, which are in no rate", count, *listed)
    yield "rollouts planned and not played", f"{sum(one.missing for one in data.cells.values())}"
