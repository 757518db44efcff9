"""Results of another run that a run is compared with: copied into its folder before it plays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec

from roboirg.analysis.results.sources import opened_sources
from roboirg.core.errors import InvalidValueError
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
    planned = {key_without_policy(job) for job in plan.jobs()}
    with opened_sources([given]) as (source,):
        names = list(dict.fromkeys(result.policy for result in source.results))
        if not names:
            raise InvalidValueError(f"{given} has no results yet.")
        if len(names) > 1:
            raise InvalidValueError(
                f"{given} has several policies ({', '.join(names)}); name one as "
                f"{source.path}:{names[0]}."
            )
        name = names[0]
        if name in [policy.name for policy in plan.policies]:
            raise InvalidValueError(
                f"{given} is of a policy with the same name as the one to play, {name}; give that "
                "another one with --policy NAME=SPEC."
            )
        # Of a run that stopped, too, only those up to its stop.
        results = source.frame_parts.results
        newest = [result for result in results if key_without_policy(result) in planned]
        if not newest:
            raise InvalidValueError(
                f"{given} has no result of an episode of this plan under the same conditions "
                "(split, settings, step limit, wordings, policy seed)."
            )
        # Checked before anything is copied: the folder could not be played into afterwards.
        for result in newest:
            end = "the two cannot be compared"
            check_same(f"{given} has results", other_versions(result), "in this roboirg", end)
        with RecordStore(folder) as store:
            missing = [result for result in newest if identity_key(result) not in store.stored]
            # A copy has no video and no actions: these stay in the other run's folder.
            copies = []
            for record in source.stored.records(missing):
                copies.append(encode(msgspec.structs.replace(record, video=None, action_log=None)))
            store.extend(copies)
        # Records name the plan that they were played for.
        for plan_name in plan_names(source.folder):
            content = read_regular(run_file(source.folder, plan_name), MOST_PLAN_BYTES)
            keep_earlier_plan(content, folder)
    rule = plan.stop or StopRule()
    return plan.model_copy(update={"stop": replace(rule, against=name)})
