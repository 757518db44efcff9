"""What a reader hears: what was said, or what a rewriter in front of it makes of that."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

from roboirg.core.delivery import SpokenInstruction
from roboirg.core.episode import Episode
from roboirg.core.observations import Pixels
from roboirg.extension.sight import LOOK_EVERY, shown_to_policy
from roboirg.policies.by_name.policy_kinds import namer_of
from roboirg.policies.contract.goal_naming import SaidAndShown
from roboirg.policies.resolving.resolving_policy import explicit_command
from roboirg.policies.resolving.rewriting import Rewriting
from roboirg.records.record import Job
from roboirg.runs.job_instruction import PreparedJob, episode_policy_seed, instruct_job

KNOWN_WORDS = "train"
"""The pool of words in which a command is rewritten: those that readers have learned."""


@functools.cache
def text_of(job: Job) -> str:
    """Return everything that is said, as a policy hears it."""
    return SpokenInstruction(instruct_job(job).turns, job.options.delivery).prompt


@functools.cache
def rewrite(namer: str, seed: int, job: Job) -> dict[str, Any]:
    """Return what ``resolve:NAMER`` passes on to a policy in a job, as the record of a run has it.

    Args:
        namer: a rule, or ``learned:FILE``.
        seed: of the run, from which the draws of a rule follow.
        job: without policy.

    Returns:
        ``heard``: the words. ``understood``: the goal that they state; missing if none was named,
        and then the words are those that were said.
    """
    text = text_of(job)
    episode = PreparedJob(job).episode
    rewriting = Rewriting(namer, {}, "", None)
    made = namer_of(rewriting, episode_policy_seed(seed, episode.seed, job.arm))
    picture: Any = None
    shown: dict[str, Any] = {}
    if hasattr(made, "cameras"):
        picture, shown["front_rgb"] = _shown(episode)
    goal = made.name_goal(SaidAndShown(job.task, text, shown, lambda: picture))
    if goal is None:
        return {"heard": text}
    command = explicit_command(episode, goal, KNOWN_WORDS)
    return {"heard": command, "understood": dict(goal.as_mapping())}


@functools.lru_cache(maxsize=1)
def _shown(episode: Episode) -> tuple[Pixels, Sequence[Pixels]]:
    """Return what a policy sees at first, as `shown_to_policy` does; settings follow each other."""
    return shown_to_policy(episode, LOOK_EVERY)
