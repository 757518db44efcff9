"""The sections of a methods section: the items that audits of language evaluations ask for.

Each item is always there; what is not known is reported as not reported. Here is how rollouts were
played; `method_statistics` has how scenes were selected and results were analyzed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from roboirg.core.actions import find_action_space
from roboirg.core.arms import ARMS, OTHER_GOAL, PARAPHRASE, SILENT_TEXTS, paraphrase_number
from roboirg.core.instruction_options import OPTION_HELP
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.evaluation.analysis.methods import method_statistics
from roboirg.evaluation.analysis.methods.method_text import Sections
from roboirg.evaluation.analysis.methods.played_facts import (
    FIXED,
    NO_NETWORK,
    NOT_RECORDED,
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
from roboirg.evaluation.analysis.stats.sensitivity import families_of
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.stored_plans import read_earlier_plans, read_plan
from roboirg.evaluation.policy_calls import SERVER
from roboirg.evaluation.records.record import DEFAULT_MAX_STEPS, Job, Summary
from roboirg.evaluation.records.store import iterate_records, read_results
from roboirg.language.settings import all_settings
from roboirg.tasks import every_task
from roboirg.util.media import CONTROL_RATE

_POOL_NOTES: Mapping[str | None, str] = {
    "test": "in neither, as their templates are held out",
    "train": "perhaps, as their templates are the same",
    FIXED: "in neither, as it is the fixed text of a control arm",
    None: f"{NOT_REPORTED} by roboirg, as the words are from a file",
}

_STATES = {
    **dict.fromkeys(("openpi", "mme-vla", "lerobot"), "7 joint angles (rad), first finger (m)"),
    "": "7 joint angles (rad), 2 finger positions (m), end-effector pose (6 numbers)",
}

Played = Mapping[str, PlayedFacts]
"""The facts of each policy, by its name."""
ColumnTexts = Mapping[TextColumn, SaidTexts]


def make_sections(folder: Path) -> Sections:
    """Return the methods section of the run in a folder.

    Raises:
        StoreError: the folder holds no run.
    """
    results, plan = read_results(folder), read_plan(folder)
    planned = plan.drawable_jobs() if plan else ()
    data = RunData.of([(str(folder), results)], planned)
    kept = {(one.slug, one.started_at) for one in results}  # without what was played again
    newest = (one for one in iterate_records(folder) if (one.slug, one.started_at) in kept)
    played, said = read_facts(newest)
    families = [*families_of(data)]
    plans = (*filter(None, [plan]), *read_earlier_plans(folder))
    jobs = planned or [one.identity for one in results]
    return {
        "Terms": dict(_terms(jobs)),
        "Horizon and control rate": dict(_horizon(results, plans, played)),
        "Precision of inference": dict(_precision(results, played)),
        "Observations": dict(_observations(results, played)),
        "Instructions": dict(_instructions(results, played, said)),
        "Use of the words in training": dict(_training(played, said)),
        "Screening of scenes": dict(method_statistics.screening_items(jobs)),
        "Statistics": dict(method_statistics.statistics_items(data, families)),
        "Sensitivity to analysis choices": dict(method_statistics.sensitivity_items(families)),
        "Controls and floors": dict(method_statistics.control_items(data, jobs)),
        "Seeds, retries and errors": dict(method_statistics.error_items(results, data, played)),
    }


def _terms(jobs: Sequence[Job]) -> Items:
    yield "scene", "one numbered start of a task: its objects, their motions, a goal"
    yield "rollout", "one scene played once, in one setting and arm, with one policy seed"
    for setting in dict.fromkeys(job.setting for job in jobs):
        found = all_settings().get(setting)
        yield f"setting {setting}", found.summary if found else NOT_REPORTED
    for arm in dict.fromkeys(job.arm for job in jobs):
        yield f"arm {arm}", ARMS[PARAPHRASE if paraphrase_number(arm) else arm]


def _horizon(results: Sequence[Summary], plans: Sequence[Plan], played: Played) -> Items:
    limits = {one.max_steps for one in results}
    has_other = any(one.arm == OTHER_GOAL for one in results)
    both = " (arm other-goal: and that on the scene's own goal)" * has_other
    yield item(
        "step limit of a rollout",
        _limit("control steps of the policy", limits, DEFAULT_MAX_STEPS),
        "the video before its turn does not count",
        f"a rollout ends with its verdict{both}",
        "or at the limit, where what is undecided fails",
    )
    fields = {"call of the policy": "policy_timeout_s", "rollout": "episode_timeout_s"}
    waits = [
        _limit(f"s per {what}", {getattr(of, key) for of in plans}, Plan.model_fields[key].default)
        for what, key in fields.items()
        if plans
    ]
    yield item(
        "wall-clock limits, in all plans of the run",
        *(waits or [f"{NOT_REPORTED}, as the run has no plan"]),
        "a rollout that exceeds one ends in an error",
    )
    yield item(
        "control rate",
        f"{CONTROL_RATE} control steps a second of simulated time",
        "the simulation waits for the policy",
    )
    for name, facts in played.items():
        mean = f"{facts.steps / facts.calls:.1f}" if facts.calls else NOT_RECORDED
        every = facts.need("observe_every")
        between = every if every in ("none", NOT_RECORDED) else f"every {every} steps"
        yield item(
            name,
            f"actions: {_action_space(facts.need('actions'))}",
            *map(facts.labeled, ("chunk", "execute")),
            "executed per call: all actions returned, but none after the rollout's end",
            f"on average {mean} control steps, calls that an end cut short included",
            f"returned per call on average: {NOT_REPORTED} by roboirg",
            f"observations within a chunk: {between}",
        )


def _limit(unit: str, values: Collection[float], default: float) -> str:
    ours = "the benchmark's limit"
    origin = ours if {*values} == {default} else f"set for this run; {ours} is {default:g}"
    return f"{', '.join(f'{one:g}' for one in sorted(values))} {unit} ({origin})"


def _action_space(name: str) -> str:
    if name == NOT_RECORDED or ";" in name:
        return name
    space = find_action_space(name)
    steps = "one control step each" if not space.takes_many_steps else "of many control steps each"
    return f"{name} ({space.describe}), {steps}"


def _precision(results: Sequence[Summary], played: Played) -> Items:
    for name, facts in played.items():
        served = f"by its server; {facts.labeled('policy')}"
        place = served if facts.is_remote else "on the machine of the simulation"
        keys = ("dtype", "parameter_dtype", "device", "libraries", "python")
        version = facts.labeled("version").replace(": built-in", ": that of roboirgbench, below")
        yield item(name, f"computed {place}", version, *map(facts.labeled, keys))
    yield item(
        "simulation",
        f"package roboirg {distinct(one.package_version for one in results)}, which calls the "
        "policies",
        f"version of SAPIEN: {NOT_REPORTED} by roboirg",
        f"processor: {distinct(one.processor for one in results)}",
    )


def _observations(results: Sequence[Summary], played: Played) -> Items:
    scenes = {(one.task, one.split, one.episode): one.demonstration_steps > 0 for one in results}
    blind = all(facts.need("cameras") == "none" for facts in played.values())
    devices = distinct(one.render_device for one in results)
    version = distinct(one.environment_version for one in results)
    yield item(
        "source",
        f"simulated in SAPIEN by roboirg's implementation (version {version}) of RoboMME's tasks",
        f"meshes: {distinct(one.meshes for one in results)} (faithful are RoboMME's)",
        "not rendered, as no policy has a camera" if blind else f"rendered on {devices}",
        f"scenes with a video before the policy's turn: {sum(scenes.values())} of {len(scenes)}",
    )
    for name, facts in played.items():
        cameras = facts.need("cameras")
        size = (
            "" if cameras in ("none", NOT_RECORDED) else "; rendered and sent at 256 × 256 pixels"
        )
        frames = facts.need("demonstration_frames")
        kind = ", the state of the robot without pictures" if cameras == "none" != frames else ""
        state = _STATES.get(facts.scheme or SERVER * facts.is_remote, f"{NOT_REPORTED} by roboirg")
        yield item(
            name,
            f"cameras that it declares to need, and whose pictures it was given: {cameras}{size}",
            f"depth: {facts.need('depth')}",
            f"state of the robot given to it: {state}",
            f"frames of that video which it takes: {frames}{kind}",
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
            listed = "the command `roboirg export instructions` lists texts and templates"
            yield item(label, "English", f"template set {versions}", listed, *pools)
        else:
            yield label, "commands of a file"
    used = {one.options.delivery for one in results}
    ways = OPTION_HELP["delivery"].rstrip(".").split("; ")
    yield item("delivery", *(way for way in ways if way.partition(":")[0] in used))
    if any(one.commands for one in said.values()):
        yield item("command templates", *_commands(said))
    for column in sorted(said, key=lambda one: (options_sort_key(one.options), one.arm)):
        yield column.label, _counts(said[column], is_fixed=column.arm in SILENT_TEXTS)
    for name, facts in played.items():
        yield item(name, *_reading(facts))


def _counts(said: SaidTexts, *, is_fixed: bool) -> str:
    texts = counted(len(said.texts), "distinct text")
    if not said.commands:
        return f"{texts}, " + ("fixed" if is_fixed else f"templates: {NOT_RECORDED}")
    return (
        f"{texts}; command templates: {len(said.commands)}; distinct wordings drawn apart from "
        f"them (other utterances, single words, referring expressions): {len(said.choices)}"
    )


def _commands(said: ColumnTexts) -> Iterator[str]:
    used = set().union(*(one.commands for one in said.values()))
    pools = {*POOLS} & {pool for one in said.values() for _, pool in one.texts}
    tasks = {task for task, _ in used} & every_task().keys()
    there = sum(
        len(every_task()[task].commands.wordings.of(pool)) for task in tasks for pool in pools
    )
    yield f"{len(used)} of the {there} in the pool for {counted(len(tasks), 'task')}, in the run"
    yield "drawn by scene and number of colors in the goal: settings share them, paraphrases do not"
    yield f"how many wordings apart from them could be drawn: {NOT_REPORTED} by roboirg"


def _reading(facts: PlayedFacts) -> Iterator[str]:
    yield facts.labeled("reads_text")
    lowered = {"yes": "in lower case", "no": "as written"}
    yield f"sent: {lowered.get(facts.need('lowers_prompt'), NOT_RECORDED)}"
    if facts.know("reads_text").split(",")[0] == "no":
        yield "what it does to the text, and texts cut at a limit of tokens: not applicable"
        return
    yield facts.labeled("text_normalization")
    limit, found = facts.need("prompt_tokens"), facts.verdicts
    if facts.know("dtype") == NO_NETWORK:
        yield f"texts cut at a limit of tokens: {NO_NETWORK}"
    elif limit in ("none", NOT_RECORDED):
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
    yield item("occurrence of the texts in the splits train and val, learned from or not", *listed)
