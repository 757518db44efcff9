"""Results of another run that a run is compared with: copied into its folder before it plays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import msgspec

from roboirg.analysis.results.sources import Source, opened_sources
from roboirg.core.errors import InvalidValueError
from roboirg.records.record import Summary
from roboirg.records.record_codec import encode, identity_key
from roboirg.records.run_files import (
    MOST_PLAN_BYTES,
    keep_earlier_plan,
    plan_names,
    run_file,
)
from roboirg.records.store import RecordStore, check_same
from roboirg.runs.job_instruction import other_versions
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_sections import StopRule
from roboirg.runs.plan.stopping import key_without_policy
from roboirg.util.regular_file import read_regular


def against_stored(plan: Plan, given: str, folder: Path) -> Plan:
    """Return a plan that compares its policy with one that has played already.

    The results of that policy in the plan's episodes, under the same conditions, are copied into
    the folder of the run; what is there already is not copied again. So the folder has both sides.

    Args:
        plan: of one policy.
        given: a run or pack with its policy, such as ``results/base.roboirg.zip:pi0``; the policy
            may be left out if there is only one.
        folder: of the run.

    Raises:
        InvalidValueError: there are several policies, the name is that of a planned one, or no
            result is of an episode of the plan.
        StoreError: the results are of other versions of language or environment.
    """
    if len(plan.policies) > 1:
        several = ", ".join(policy.name for policy in plan.policies)
        raise InvalidValueError(
            f"--against compares one policy with a stored one; this plan has several: {several}."
        )
    with opened_sources([given]) as (source,):
        name = _only_policy(source, given)
        if name == plan.policies[0].name:
            raise InvalidValueError(
                f"{given} is of a policy with the same name as the one to play, {name}; give that "
                "another one with --policy NAME=SPEC."
            )
        results = _results_in_plan(source, plan, given)
        _copy_results(source, results, folder)
        _copy_plans(source.folder, folder)
    rule = plan.stop or StopRule()
    return plan.model_copy(update={"stop": replace(rule, against=name)})


def _only_policy(source: Source, given: str) -> str:
    """Return the name of the one policy with results in a run; raise if there are several.

    Args:
        source: the run, or one policy of it.
        given: as typed, for the error.
    """
    names = list(dict.fromkeys(result.policy for result in source.results))
    if not names:
        raise InvalidValueError(f"{given} has no results yet.")
    if len(names) > 1:
        raise InvalidValueError(
            f"{given} has several policies ({', '.join(names)}); name one as "
            f"{source.path}:{names[0]}."
        )
    return names[0]


def _results_in_plan(source: Source, plan: Plan, given: str) -> list[Summary]:
    """Return the results of the plan's episodes, under its conditions.

    Of a run that stopped when it was decided, these are the ones that count.

    Raises:
        InvalidValueError: there are none.
        StoreError: they are of other versions; the folder could not be played into afterwards.
    """
    planned = {key_without_policy(job) for job in plan.jobs()}
    results = []
    for result in source.frame_parts.results:
        if key_without_policy(result) in planned:
            results.append(result)
    if not results:
        raise InvalidValueError(
            f"{given} has no result of an episode of this plan under the same conditions "
            "(split, settings, step limit, wordings, policy seed)."
        )
    for result in results:
        end = "the two cannot be compared"
        check_same(f"{given} has results", other_versions(result), "in this roboirg", end)
    return results


def _copy_results(source: Source, results: Iterable[Summary], folder: Path) -> None:
    """Copy results into the folder of another run, unless it has them.

    A copy has no video and no actions: these stay in the first run's folder.
    """
    with RecordStore(folder) as store:
        missing = [result for result in results if identity_key(result) not in store.stored]
        lines = []
        for record in source.stored.records(missing):
            lines.append(encode(msgspec.structs.replace(record, video=None, action_log=None)))
        store.extend(lines)


def _copy_plans(source: Path, folder: Path) -> None:
    """Keep the plans of a folder in another one: records name the plan that they are of."""
    for name in plan_names(source):
        content = read_regular(run_file(source, name), MOST_PLAN_BYTES)
        keep_earlier_plan(content, folder)
