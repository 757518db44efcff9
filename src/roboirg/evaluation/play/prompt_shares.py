"""Which episodes of a plan are longer than what the policies' language models read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from roboirg.core.delivery import PromptVerdict, utterance_steps
from roboirg.evaluation.episode_errors import EpisodeError
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.records.record import Job, PromptAudit
from roboirg.language.instruction import Instruction
from roboirg.policies.prompt_length.prompt_audit import (
    InstructionAudit,
    PromptLimit,
    audit_instruction,
)
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit

Verdicts = Counter[PromptVerdict]


class PromptShares(NamedTuple):
    """How many episodes of a policy are heard, cut or unknown.

    Attributes:
        policy: its name.
        limit: that it declares; None if it declares none.
        settings: verdicts by setting.
    """

    policy: str
    limit: PromptLimit | None
    settings: Mapping[str, Verdicts]


def sent_messages(turns: Sequence[str], steps: Sequence[int | None]) -> tuple[tuple[str, ...], ...]:
    """Return the utterances of each message.

    Args:
        turns: texts of the utterances.
        steps: control step at which each was heard; None if it was not.
    """
    said = [pair for pair in zip(turns, steps, strict=True) if pair[1] is not None]
    return tuple(tuple(turn for turn, _ in group) for _, group in groupby(said, itemgetter(1)))


def audit_prompt(
    instruction: Instruction, steps: Sequence[int | None], limit: PromptLimit
) -> tuple[PromptAudit, PromptVerdict]:
    """Return what of an instruction reaches a policy's model, and the verdict.

    Args:
        instruction: what is said.
        steps: control step at which each utterance is heard; None if it is not.
        limit: of the policy.
    """
    found: InstructionAudit = audit_instruction(sent_messages(instruction.turns, steps), limit)
    spans = [(one.utterance, one.end) for one in instruction.mentions]
    audit = PromptAudit(
        limit=limit.tokens,
        needed=(found.least, found.most),
        tokenizer=limit.tokenizer,
        reached=found.reached,
        lost=found.lost(spans),
    )
    return audit, found.verdict


def audit_job(
    job: Job, limit: PromptLimit, instruction: Instruction | None = None
) -> tuple[PromptAudit, PromptVerdict]:
    """Return the audit of a job before it is played, each utterance being heard when it is said."""
    instruction = instruction or instruct_job(job)
    return audit_prompt(
        instruction, utterance_steps(len(instruction.utterances), job.options.delivery), limit
    )


def check_prompt(audit: PromptAudit, verdict: PromptVerdict) -> None:
    """Refuse an instruction that is certainly cut.

    Raises:
        EpisodeError: it is.
    """
    if verdict == "cut":
        words = (
            f"the instruction needs {audit.needed_text} tokens, but the policy's model reads "
            f"{audit.limit}; long_prompts: send in the plan plays the episode anyway"
        )
        raise EpisodeError("prompt", words, "")


def prompt_shares(jobs: Iterable[Job]) -> tuple[PromptShares, ...]:
    """Return for each policy how many episodes are cut, by setting, in the order of the jobs."""
    limits: dict[str, PromptLimit | None] = {}
    counts: dict[str, dict[str, Verdicts]] = {}
    verdicts: dict[tuple[object, ...], PromptVerdict] = {}
    for job in jobs:
        if job.policy not in limits:
            needs = None if job.ref is None else job.ref.needs
            limits[job.policy] = None if needs is None else prompt_limit(needs)
        limit = limits[job.policy]
        verdict: PromptVerdict = "unknown"
        if limit is not None:
            key = (limit, job.task, job.split, job.episode, job.options, job.arm)
            if key not in verdicts:
                verdicts[key] = audit_job(job, limit)[1]
            verdict = verdicts[key]
        counts.setdefault(job.policy, {}).setdefault(job.setting, Counter())[verdict] += 1
    return tuple(PromptShares(policy, limit, counts[policy]) for policy, limit in limits.items())


def share_text(verdicts: Verdicts) -> str:
    """Return the share that is cut in percent, such as ``12 %``, or between bounds ``3–12 %``."""
    total = verdicts.total()
    least = 100 * verdicts["cut"] / total
    most = 100 * (verdicts["cut"] + verdicts["unknown"]) / total
    low, high = (_percent(share) for share in (least, most))
    return f"{low} %" if low == high else f"{low}–{high} %"


def warning_lines(shares: Iterable[PromptShares]) -> Iterator[str]:
    """Yield a sentence for each policy that does not read every instruction whole."""
    for one in shares:
        settings = ", ".join(
            f"{setting} {share_text(verdicts)}"
            for setting, verdicts in one.settings.items()
            if verdicts["cut"] + verdicts["unknown"]
        )
        if one.limit is not None and settings:
            yield (
                f"{one.policy} reads {one.limit.tokens} tokens of a prompt: the end of these "
                f"instructions does not reach it: {settings}."
            )


def _percent(share: float) -> str:
    """Return a percentage; one that is not 0 does not look like 0."""
    return f"{share:.0f}" if share == 0 or share >= 1 else "<1"
