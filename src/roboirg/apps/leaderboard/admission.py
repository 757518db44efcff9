"""Which packed runs the board ranks: whole runs of a plan that comes with the package.

So tasks, settings, episodes and seeds are not chosen after the results are known. What this
cannot catch stands in docs/verification.md.
"""

from __future__ import annotations

import functools
import operator
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import msgspec

from roboirg.core.arms import TOLD
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.comparability import is_robomme
from roboirg.evaluation.analysis.stats.cells import PolicyRun
from roboirg.evaluation.plan.plan import REQUIRED
from roboirg.evaluation.plan.plan_file import named_plans, read_plan_file
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import kept_fingerprints
from roboirg.evaluation.records.record import IDENTITY, Summary
from roboirg.evaluation.records.store import read_results
from roboirg.tasks.splits.private_splits import is_private

_CHOSEN = {"policy", "actions", "demonstration_frames", "observe_every", "options"}
"""What a named plan leaves to the policy; words are compared apart."""
_key = operator.attrgetter(*(name for name in IDENTITY if name not in _CHOSEN), "column")


class NamedEpisodes(NamedTuple):
    """The episodes of a plan that comes with the package, for any policy.

    Attributes:
        keys: what identifies them, the policy's own choices left out.
        in_robommes_words: whether their instructions are RoboMME's.
    """

    keys: frozenset[object]
    in_robommes_words: bool


def ranked_plans() -> tuple[str, ...]:
    """Return the names of the plans that the board ranks: all but those of a few episodes."""
    return tuple(name for name in named_plans() if name not in ("demo", "quick"))


def find_refusal(folder: Path) -> str:
    """Return why the board does not rank a run; empty if it does."""
    return refusal(read_results(folder), kept_fingerprints(folder))


def refusal(results: Sequence[Summary], known: Collection[str]) -> str:
    """Return why a packed run is not ranked; empty if it is.

    Args:
        results: of the run.
        known: fingerprints of the plans in the pack.
    """
    if stray := sum(one.plan not in known for one in results):
        return f"{counted(stray, 'record')} outside every plan in the pack"
    by_run: dict[PolicyRun, list[Summary]] = defaultdict(list)
    for one in results:
        by_run[PolicyRun.of(one)].append(one)
    return next(filter(None, map(_run_refusal, by_run.values())), "")


def _run_refusal(records: Sequence[Summary]) -> str:
    """Return why one policy's episodes are no whole named plan; empty if they are one."""
    played = [one for one in records if one.arm == TOLD]
    if not played:
        return f"{records[0].policy} played control arms alone"
    first = played[0]
    keys = frozenset(map(_key, played))
    if all(one.outcome == "error" for one in played):
        return f"every episode of {first.policy} ended in an error"
    differences = {
        name: (len(plan.keys - keys), len(keys - plan.keys))
        for name, plan in _plans(first.split, first.options.wordings)
    }
    if (0, 0) in differences.values():
        return ""
    if not differences:
        return f"the words or the split of {first.policy} match no named plan"
    name, (missing, more) = min(differences.items(), key=lambda one: sum(one[1]))
    parts = [f"{missing:,} missing"] * bool(missing) + [f"{more:,} not in it"] * bool(more)
    return (
        f"the episodes of {first.policy} do not make up a whole plan of "
        f"{', '.join(ranked_plans())}; nearest is {name}: {' and '.join(parts)}"
    )


def _plans(split: str, wordings: str | None) -> Iterator[tuple[str, NamedEpisodes]]:
    for name in ranked_plans():
        plan = _named(name, split)
        if plan is None:
            continue
        if is_robomme(wordings) if plan.in_robommes_words else wordings is None:
            yield name, plan


@functools.cache
def _named(name: str, split: str) -> NamedEpisodes | None:
    """Return the episodes of a named plan on its split or a private one; None on another."""
    chosen = read_plan_file(name)
    if not is_private(split) and split != chosen.get("split", split):
        return None
    needs_words = chosen.get("wordings") == REQUIRED
    if needs_words:
        del chosen["wordings"]  # of explicit episodes, which any words can express
    plan = make_plan(**{**chosen, "policies": ["random"], "split": split})
    return NamedEpisodes(frozenset(map(_key, plan.jobs())), needs_words)


def with_failures(results: Iterable[Summary]) -> list[Summary]:
    """Return results in which errors are failures: what a policy broke, it did not do."""
    failed = partial(msgspec.structs.replace, outcome="failure", error=None, attribution=None)
    return [failed(one) if one.outcome == "error" else one for one in results]
