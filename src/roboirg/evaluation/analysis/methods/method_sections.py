"""The sections of a methods section: the items that audits of language evaluations ask for.

Each item is always there; what is not known is reported as not reported. Here is how rollouts were
played; `method_statistics` has how scenes were selected and results were analyzed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from roboirg.core.actions import find_action_space
from roboirg.core.arms import ARMS, PARAPHRASE, SILENT_TEXTS, paraphrase_number
from roboirg.core.instruction_options import OPTION_HELP
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.evaluation.analysis.methods.method_statistics import (
    control_items,
    error_items,
    screening_items,
    sensitivity_items,
    statistics_items,
)
from roboirg.evaluation.analysis.methods.method_text import Sections
from roboirg.evaluation.analysis.methods.played_facts import (
    NO_NETWORK,
    NOT_REPORTED,
    Items,
    PlayedFacts,
    SaidTexts,
    TextColumn,
    distinct,
    item,
    read_facts,
)
from roboirg.evaluation.analysis.stats.option_labels import options_sort_key
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.records.record import Job, Record, Summary
from roboirg.evaluation.records.store import iterate_records, read_results
from roboirg.language.settings import all_settings
from roboirg.tasks import every_task
from roboirg.util.media import CONTROL_RATE

_POOL_NOTES: Mapping[str | None, str] = {
    "test": "cannot occur, as their templates are held out of these splits",
    "train": "can occur, as their templates are those of these splits",
    None: f"{NOT_REPORTED}, as they are fixed or from a file",
}

Played = Mapping[str, PlayedFacts]
"""The facts of each policy, by its name."""
ColumnTexts = Mapping[TextColumn, SaidTexts]


def make_sections(folder: Path, planned: Sequence[Job]) -> Sections:
    """Return the methods section of a run.

    Args:
        folder: of the run.
        planned: jobs of its plan.

    Raises:
        StoreError: the folder holds no run.
    """
    results = read_results(folder)
    data = RunData.of([(str(folder), results)], planned)
    played, said = read_facts(_newest(folder, results))
    jobs = planned or [one.identity for one in results]
    return {
        "Terms": dict(_terms(jobs)),
        "Horizon and control rate": dict(_horizon(results, played)),
        "Precision of inference": dict(_precision(results, played)),
        "Observations": dict(_observations(results, played)),
        "Instructions": dict(_instructions(results, played, said)),
        "Use of the words in training": dict(_training(played, said)),
        "Screening of scenes": dict(screening_items(jobs)),
        "Statistics": dict(statistics_items(data)),
        "Sensitivity to analysis choices": dict(sensitivity_items(data)),
        "Controls and floors": dict(control_items(data, jobs)),
        "Seeds, retries and errors": dict(error_items(results, data, played)),
    }


def _newest(folder: Path, results: Iterable[Summary]) -> Iterator[Record]:
    """Yield the records behind results, without those that were played again."""
    kept = {(one.slug, one.started_at) for one in results}
    return (one for one in iterate_records(folder) if (one.slug, one.started_at) in kept)


def _terms(jobs: Sequence[Job]) -> Items:
    yield "scene", "one numbered start of a task: its objects, their motions, a goal"
    yield "rollout", "one scene played once, in one setting and arm, with one policy seed"
    for setting in dict.fromkeys(job.setting for job in jobs):
        found = all_settings().get(setting)
        yield f"setting {setting}", found.summary if found else NOT_REPORTED
    for arm in dict.fromkeys(job.arm for job in jobs):
        yield f"arm {arm}", ARMS[PARAPHRASE if paraphrase_number(arm) else arm]


def _horizon(results: Sequence[Summary], played: Played) -> Items:
    yield item(
        "step limit of a rollout",
        f"{distinct(one.max_steps for one in results)} control steps of the policy",
        "the video before its turn does not count",
    )
    yield "control rate", f"{CONTROL_RATE} control steps a second"
    for name, facts in played.items():
        mean = f"{facts.steps / facts.calls:.1f}" if facts.calls else NOT_REPORTED
        every = facts.need("observe_every")
        between = every if every in ("none", NOT_REPORTED) else f"every {every} steps"
        yield item(
            name,
            f"actions: {_action_space(facts.need('actions'))}",
            facts.labeled("chunk"),
            f"executed per call: the whole chunk, or to the rollout's end; {mean} on average",
            f"observations within a chunk: {between}",
        )


def _action_space(name: str) -> str:
    if name == NOT_REPORTED or ";" in name:
        return name
    space = find_action_space(name)
    steps = "one control step each" if not space.takes_many_steps else "of many control steps each"
    return f"{name} ({space.describe}), {steps}"


def _precision(results: Sequence[Summary], played: Played) -> Items:
    for name, facts in played.items():
        place = "by its server" if facts.is_remote else "on the machine of the simulation"
        keys = ("dtype", "device", "libraries", "python")
        yield item(name, f"computed {place}", *map(facts.labeled, keys))
    yield item(
        "simulation",
        f"package roboirg {distinct(one.package_version for one in results)}, which calls the "
        "policies",
        f"processor: {distinct(one.processor for one in results)}",
    )


def _observations(results: Sequence[Summary], played: Played) -> Items:
    blind = all(facts.need("cameras") == "none" for facts in played.values())
    devices = distinct(one.render_device for one in results)
    version = distinct(one.environment_version for one in results)
    yield item(
        "source",
        f"simulated by roboirg in SAPIEN, environment version {version}",
        f"{distinct(one.meshes for one in results)} meshes",
        "not rendered, as no policy has a camera" if blind else f"rendered on {devices}",
    )
    for name, facts in played.items():
        cameras = facts.need("cameras")
        size = "" if cameras in ("none", NOT_REPORTED) else ", each 256 × 256 pixels"
        yield item(
            name,
            f"cameras: {cameras}{size}",
            f"depth: {facts.need('depth')}",
            f"frames of the video before its turn, each a state and these cameras' pictures: "
            f"{facts.need('demonstration_frames')}",
            f"reads the simulator's state: {'yes' if facts.is_privileged else 'no'}",
            facts.labeled("preprocessing"),
        )


def _instructions(results: Sequence[Summary], played: Played, said: ColumnTexts) -> Items:
    versions = distinct(one.language_version for one in results)
    for wordings in sorted({one.options.wordings for one in results}, key=str):
        label = "words" if wordings is None else f"words of {wordings}"
        splits = sorted({one.split for one in results if one.options.wordings == wordings})
        pools = [f"{pool_of(one, wordings)} pool for the split {one}" for one in splits]
        if wordings in (None, *POOLS):
            wording = "written out by roboirg export instructions"
            yield item(label, f"template set {versions}, {wording}", *pools)
        else:
            yield label, "commands of a file"
    used = {one.options.delivery for one in results}
    ways = OPTION_HELP["delivery"].rstrip(".").split("; ")
    yield item("delivery", *(way for way in ways if way.partition(":")[0] in used))
    for column in sorted(said, key=lambda one: (options_sort_key(one.options), one.arm)):
        yield column.label, _counts(said[column], is_fixed=column.arm in SILENT_TEXTS)
    for name, facts in played.items():
        yield item(name, *_reading(facts))


def _counts(said: SaidTexts, *, is_fixed: bool) -> str:
    texts = counted(len(said.texts), "distinct text")
    if not said.commands:
        return f"{texts}, " + ("fixed" if is_fixed else f"templates: {NOT_REPORTED}")
    pools = {pool for _, pool in said.texts}
    tasks = {task for task, _ in said.commands} & every_task().keys()
    there = sum(
        len(every_task()[task].commands.wordings.of(pool))
        for task in tasks
        for pool in POOLS
        if pool in pools
    )
    return (
        f"{texts}, from {len(said.commands)} of the {there} templates of commands in the pool for "
        f"{counted(len(tasks), 'task')}; {len(said.wordings)} distinct choices outside the command "
        "(sentences before it, referring expressions and other parts)"
    )


def _reading(facts: PlayedFacts) -> Iterator[str]:
    yield facts.labeled("reads_text")
    if facts.know("reads_text").split(",")[0] == "no":
        return
    lowered = {"yes": "in lower case", "no": "as written"}
    yield f"sent: {lowered.get(facts.need('lowers_prompt'), NOT_REPORTED)}"
    yield facts.labeled("text_normalization")
    limit, found = facts.need("prompt_tokens"), facts.verdicts
    if facts.know("dtype") == NO_NETWORK:
        yield f"texts cut at a limit of tokens: {NO_NETWORK}"
    elif limit in ("none", NOT_REPORTED):
        yield f"texts cut at a limit of tokens: {NOT_REPORTED}, as it declares no limit"
    else:
        unsure = found.total() - found["heard"] - found["cut"]
        yield f"texts cut at its limit of {limit} tokens: {found['cut']} of {found.total()}"
        yield f"unknown without its tokenizer: {unsure}"


def _training(played: Played, said: ColumnTexts) -> Items:
    for name, facts in played.items():
        yield name, facts.labeled("trained_on")
    texts = set().union(*(one.texts for one in said.values()))
    pools = Counter(_POOL_NOTES[pool] for _, pool in texts)
    listed = (f"{counted(pools[note], 'text')}: {note}" for note in sorted(pools))
    yield item("texts in training on the splits train and val", *listed)
