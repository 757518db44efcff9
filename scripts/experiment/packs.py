"""The full records of a study as a pack, which every command for results reads."""

from __future__ import annotations

from experiment.frame import found_plays, record_of
from experiment.study import Study
from roboirg.apps.leaderboard.packing import pack_run
from roboirg.records.packs import PACK_SUFFIX
from roboirg.records.record_codec import encode
from roboirg.records.store import RECORDS_FILE
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.util.atomic_write import replacing


def write_pack(study: Study) -> None:
    """Write the records of all rows as a pack, with the actions that proofs of the study left.

    The seed of a training is in the place of a policy's seed.
    """
    policies = {row.policy: row.ref for row in study.rows()}
    played = {"policies": tuple(policies.values()), "policy_seeds": tuple(study.seeds)}
    plan = study.plan().model_copy(update=played)
    with replacing(study.run / RECORDS_FILE) as part, part.open("wb") as file:
        for wanted, play in found_plays(study):
            record = record_of(wanted.trial, play)
            record.plan = plan.fingerprint
            file.write(encode(record) + b"\n")
    write_plan(plan, study.run)
    path = study.results / f"{study.name}{PACK_SUFFIX}"
    manifest = pack_run(study.run, path)
    print(f"{path}: {manifest.records:,} records, {path.stat().st_size:,} bytes")
