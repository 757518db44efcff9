"""Estimate what the models of a plan's policies will be asked, and what that costs."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.records.record import Job
from roboirg.evaluation.run.world_speed import has_video
from roboirg.policies.by_name.loading import (
    hands_of,
    is_foreign,
    make_policy,
    undeclared,
    with_scripted_hands,
)
from roboirg.policies.by_name.policy_specs import PLANNER
from roboirg.policies.by_name.systems import SCRIPTED
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.planners.hierarchical_policy import MOST_REFUSALS
from roboirg.policies.planners.rehearsal import (
    CHUNK,
    SUBGOAL_STEPS,
    CallSizes,
    rehearse,
    rehearse_listener,
)
from roboirg.policies.planners.vlm_planner import VLMPlanner
from roboirg.policies.vlm.models import ModelOptions, ModelReply
from roboirg.policies.vlm.models.paid_model import cost_of
from roboirg.policies.vlm.models.reply_store import stored_counts
from roboirg.policies.vlm.vlm_listener import VLMListener

SHOWN_STEPS = 430
"""Control steps of a video; mean over the tasks with a video."""


class ModelCost(NamedTuple):
    """What the model of a policy will be asked in the episodes of a setting.

    Attributes:
        policy: its name.
        setting: of the episodes.
        sizes: calls and tokens of all of them.
        cost_usd: US dollars; None if the prices are not known.
        measured: calls of this policy that were answered before, whose mean size was taken; 0 if
            letters and pictures were counted.
    """

    policy: str
    setting: str
    sizes: CallSizes
    cost_usd: float | None
    measured: int


def model_costs(todo: Iterable[Job], jobs: Iterable[Job], folder: Path) -> tuple[ModelCost, ...]:
    """Return what the models of the policies are expected to be asked.

    A planner's episode has as many subgoals as the goal of its scene.

    Args:
        todo: jobs to play.
        jobs: all of the plan, whose answered calls are in the folder.
        folder: of the run.
    """
    sizes: defaultdict[tuple[str, str], CallSizes] = defaultdict(CallSizes)
    askers: dict[str, VLMPlanner | VLMListener] = {}
    alike: dict[tuple[object, ...], CallSizes] = {}
    for job in todo:
        asker = _asker(job.policy_spec)
        if asker is None:
            continue
        prepared = PreparedJob(job)
        key = job.policy, job.setting
        kind = (*key, *_kind_of(asker, prepared))
        if kind not in alike:
            alike[kind] = _episode_sizes(asker, prepared)
        askers[job.policy] = asker
        sizes[key] = sizes[key].plus(alike[kind])
    known = _measured(jobs, folder)
    return tuple(
        _model_cost(key, counted, known.get(key[0], CallSizes()), askers[key[0]].options.model)
        for key, counted in sizes.items()
    )


def unknown_costs(jobs: Iterable[Job]) -> Iterator[str]:
    """Yield a sentence for each planner whose calls depend on what is not known before it plays."""
    for name, spec in dict.fromkeys((job.policy, job.policy_spec) for job in jobs):
        if hands_of(spec) not in (None, SCRIPTED) and _asker(spec) is not None:
            yield (
                f"{name}: how long its hands take is unknown before they play, so calls are "
                f"counted as with the scripted hands: {SUBGOAL_STEPS} control steps for a "
                f"subgoal, in chunks of {CHUNK}. Before each chunk there are at most 2 calls, or "
                f"{2 * MOST_REFUSALS} if the hands refuse its subgoals."
            )
        elif undeclared(spec).startswith(f"{PLANNER}:") and hands_of(spec) is None:
            yield (
                f"{name}: the number of model calls is unknown, because the planner is your own "
                "code; its plan() is called before each chunk of the hands."
            )


def _model_cost(
    key: tuple[str, str], counted: CallSizes, measured: CallSizes, model: ModelOptions
) -> ModelCost:
    if measured.calls:
        share = counted.calls / measured.calls
        of_tokens = (one * share for one in measured[1:])
        counted = CallSizes(counted.calls, *of_tokens)
    reply = ModelReply("", *(round(one) for one in counted[1:]))
    return ModelCost(*key, counted, cost_of(model, reply), round(measured.calls))


def _measured(jobs: Iterable[Job], folder: Path) -> dict[str, CallSizes]:
    counts = stored_counts(folder)
    found: defaultdict[str, CallSizes] = defaultdict(CallSizes)
    for job in jobs if counts else ():
        if job.slug in counts:
            found[job.policy] = found[job.policy].plus(CallSizes(*counts[job.slug]))
    return found


@functools.cache
def _asker(spec: str) -> VLMPlanner | VLMListener | None:
    """Return what asks a model for a policy; None if nothing does, or it is foreign code.

    Hands are not made: nothing of a rehearsal depends on them.
    """
    if hands_of(spec) is not None:
        spec = with_scripted_hands(spec)
    if is_url(spec) or is_foreign(spec):
        return None
    policy = make_policy(spec, 0)
    asker = getattr(policy, "planner", policy)
    return asker if isinstance(asker, VLMPlanner | VLMListener) else None


def _kind_of(asker: VLMPlanner | VLMListener, prepared: PreparedJob) -> tuple[object, ...]:
    """Return what an episode's size depends on, apart from its words."""
    if isinstance(asker, VLMListener):
        return (prepared.job.task,)
    return has_video(prepared.job), len(prepared.episode.stages)


def _episode_sizes(asker: VLMPlanner | VLMListener, prepared: PreparedJob) -> CallSizes:
    words = prepared.instruction.text
    shown = SHOWN_STEPS if has_video(prepared.job) else 0
    if isinstance(asker, VLMListener):
        return rehearse_listener(asker, prepared.job.task, words, shown)
    stages = prepared.episode.stages
    subgoals = [one.subgoal.replace("{at}", "at <500, 500>") for one in stages]
    return rehearse(asker, words, shown, subgoals)
