"""Results of other harnesses as records, so that tables, statistics and the page read them.

| harness | file | what its records lack |
| --- | --- | --- |
| lerobot | ``eval_info.json`` of lerobot-eval | steps, causes, events, errors, times |
| vla-eval | ``recording-ID.sqlite`` | causes, events |
| inspect | a log as JSON (``inspect log convert --to json``) | nothing; errors: events |
| jsonl | lines ``{"task": ..., "episode": ..., "success": ...}`` | causes, events, errors, times |

What a harness does not report is named in ``policy_metadata["imported"]``, with the harness and the
file. Versions of words and environment are those of this package: import with the version that was
played. Failures have no attribution, because without events it would be a guess.
"""

from __future__ import annotations

import contextlib
import datetime as dt
import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from pydantic import JsonValue

from roboirg.core.errors import InvalidValueError, RoboIRGError, UnknownNameError
from roboirg.core.instruction_options import OPTION_NAMES
from roboirg.evaluation.hosting.policy_descriptions import PolicyDescription
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record
from roboirg.evaluation.records.record import DEFAULT_MAX_STEPS, ErrorKind, Job, Record
from roboirg.evaluation.records.record_codec import encode, read_record, with_nested_options
from roboirg.evaluation.records.store import RecordStore
from roboirg.tasks.splits.splits import split_size
from roboirg.util.regular_file import read_regular

LEROBOT_SEED = 1000
"""The seed of lerobot-eval's first episode, if none is given."""
UNTOLD_CAUSE = "the harness does not report the cause"

_MOST_BYTES = 512 << 20
"""Of a file of JSON."""

_ERRORS: Mapping[str, ErrorKind] = {
    "timeout": "timeout",
    "server_unreachable": "connection",
    "connection_closed": "connection",
    "model_act": "policy",
}
"""vla-eval's reasons that are not due to the environment."""
_FIELDS = (*Job.__struct_fields__, *OPTION_NAMES)
"""What may be reported of an episode, its instruction options included."""
_NAMES = {"action_space": "actions"}
"""Parameters of our vla-eval class that have another name in jobs."""


class ImportOptions(NamedTuple):
    """What the files of a harness do not say.

    Attributes:
        policy: name of the policy in the records.
        seed: of LeRobot's first episode.
        fields: fields of `roboirg.evaluation.records.record.Job` that differ from their defaults.
    """

    policy: str
    seed: int = LEROBOT_SEED
    fields: Mapping[str, Any] = {}


def import_results(harness: str, path: Path, out: Path, options: ImportOptions) -> int:
    """Write the results of a harness as records into a run's folder; return their number.

    Args:
        harness: lerobot, vla-eval, inspect or jsonl, a file of one's own.
        path: its file of results.
        out: folder of the records; it may already hold some.
        options: what the file does not say.

    Raises:
        UnknownNameError: there is no such harness, or a task, setting or split does not exist.
        InvalidValueError: the file is not what the harness writes, or has an episode twice.
        StoreError: the records cannot be written.
    """
    if harness not in _READERS:
        raise UnknownNameError("harness", harness, _READERS)
    try:
        records = list(_READERS[harness](path, options))
    except RoboIRGError:
        raise
    except OSError as error:
        raise InvalidValueError(f"{path} cannot be read: {error.strerror}.") from error
    except msgspec.ValidationError as error:
        raise InvalidValueError(f"{path}: {error}.") from error
    except (AttributeError, ArithmeticError, KeyError, RecursionError, TypeError, ValueError,
            sqlite3.Error) as error:  # fmt: skip
        raise InvalidValueError(
            f"{path} is not a results file of {harness} ({type(error).__name__}: {error})."
        ) from error
    _refuse_repeated(records, path)
    with RecordStore(out) as store:
        store.extend(map(encode, records))
    return len(records)


def _text(path: Path) -> str:
    return read_regular(path, _MOST_BYTES).decode()


def _read_lerobot(path: Path, options: ImportOptions) -> Iterator[Record]:
    """Yield the records of lerobot-eval; its groups are called ``task-setting-split``."""
    lacks = ("steps", "cause", "events", "errors", "timings", "started_at")
    for entry in json.loads(_text(path))["per_task"]:
        names = entry["task_group"].rsplit("-", 2)
        if len(names) != 3:  # noqa: PLR2004
            raise InvalidValueError(
                f"{path}: {entry['task_group']!r} is not a task group of this benchmark, "
                "task-setting-split."
            )
        task, setting, split = names
        for index, success in enumerate(entry["metrics"]["successes"]):
            job = _job(
                options, task=task, setting=setting, split=split,
                episode=(options.seed + index) % split_size(split),
            )  # fmt: skip
            result = _verdict(bool(success), job)
            yield _record(job, result, "lerobot", path, lacks)


def _read_vla_eval(path: Path, options: ImportOptions) -> Iterator[Record]:
    """Yield the records of a recording of vla-eval."""
    if not path.is_file():  # SQLite would create it
        raise InvalidValueError(f"There is no file {path}.")
    lacks = ("cause", "events", "started_at")
    with contextlib.closing(sqlite3.connect(path)) as database:
        configs = {
            name: json.loads(metadata)["config"]["params"]
            for name, metadata in database.execute("SELECT eval_id, metadata FROM eval_metadata")
        }
        rows = database.execute(
            "SELECT eval_id, task_name, status, steps, elapsed_sec, context, failure_reason,"
            " failure_detail FROM episode_results ORDER BY rowid"
        ).fetchall()
    for name, task, status, steps, seconds, context, reason, detail in rows:
        params = {_NAMES.get(key, key): value for key, value in configs[name].items()}
        told = {key: value for key, value in params.items() if key in _FIELDS}
        job = _job(
            options, **{"setting": "explicit", "split": "test", **told},
            task=task, episode=json.loads(context)["episode_idx"],
        )  # fmt: skip
        result = _verdict(status == "success", job)
        if status == "error":
            kind = _ERRORS.get(reason, "environment")
            if "InvalidActionError" in (detail or ""):
                kind = "invalid_action"
            result.record_error(kind, f"{kind}: vla-eval reports {reason}", detail)
        result.steps = int(steps or 0)
        yield _record(job, result, "vla-eval", path, lacks, float(seconds or 0.0))


def _read_inspect(path: Path, options: ImportOptions) -> Iterator[Record]:
    """Yield the records in a log of Inspect, which holds them whole, and those of its errors."""
    if path.suffix == ".eval":
        raise InvalidValueError(
            f"{path} is a packed log; convert it: inspect log convert --to json --output-dir LOGS "
            f"{path.name}."
        )
    samples = json.loads(_text(path))["samples"]
    for number, sample in enumerate(samples, 1):
        scores = sample.get("scores") or {}
        found = next((one["metadata"]["record"] for one in scores.values()), None)
        if found is not None:
            record = read_record(json.dumps(found).encode(), path, number)
            yield _with_fields(record, {**options.fields, "policy": options.policy})
            continue
        told = {**sample["metadata"]["job"], "policy": options.policy}
        job = _job(options, **told.pop("options", {}), **told)
        error, result = sample.get("error") or {}, RolloutResult()
        cause = f"environment: {error.get('message', 'the sample has no score')}"
        result.record_error("environment", cause, error.get("traceback"))
        yield _record(job, result, "inspect", path, ("steps", "events", "timings"))


def _read_lines(path: Path, options: ImportOptions) -> Iterator[Record]:
    """Yield a record for each line; what it has besides the verdict are fields of the job."""
    lacks = ("cause", "events", "errors", "timings", "started_at")
    for number, line in enumerate(_text(path).splitlines(), 1):
        told = json.loads(line)
        success, steps = told.pop("success"), told.pop("steps", None)
        if not isinstance(success, bool):
            raise InvalidValueError(
                f"{path}, line {number}: success is {success!r}; it must be true or false."
            )
        job = _job(options, **{"setting": "explicit", "split": "test", **told})
        result = _verdict(success, job)
        result.steps = int(steps or 0)
        yield _record(job, result, "jsonl", path, lacks if steps else ("steps", *lacks))


def _job(options: ImportOptions, **fields: Any) -> Job:  # noqa: ANN401 - values of JSON
    named = {"policy": options.policy, "max_steps": DEFAULT_MAX_STEPS, **fields}
    if unknown := named.keys() - set(_FIELDS):
        raise UnknownNameError("field of an episode", min(unknown), _FIELDS)
    return msgspec.convert(with_nested_options({**named, **options.fields}), Job, strict=False)


def _with_fields(record: Record, fields: Mapping[str, Any]) -> Record:
    words = {name: value for name, value in fields.items() if name in OPTION_NAMES}
    others = {name: value for name, value in fields.items() if name not in words}
    found = msgspec.to_builtins(record)
    changed = {**found, **others, "options": {**found["options"], **words}}
    return msgspec.convert(changed, Record, strict=False)


def _verdict(success: bool, job: Job) -> RolloutResult:
    result = RolloutResult(policy=PolicyDescription("unknown", is_privileged=False))
    status = "success" if success else "failure"
    result.record_status(status, None if success else UNTOLD_CAUSE, job.max_steps)
    return result


def _record(
    job: Job,
    result: RolloutResult,
    harness: str,
    path: Path,
    lacks: tuple[str, ...],
    seconds: float = 0.0,
) -> Record:
    imported: dict[str, JsonValue] = {
        "from": harness, "file": path.name, "lacks": [*lacks, "attribution", "policy_version"],
    }  # fmt: skip
    result.policy = result.policy or PolicyDescription("unknown", is_privileged=False)
    result.policy_metadata = {"imported": imported}
    written = dt.datetime.fromtimestamp(path.stat().st_mtime, dt.UTC).isoformat(timespec="seconds")
    record = make_record(job, result, started_at=written, duration_s=round(seconds, 3))
    return msgspec.structs.replace(record, attribution=None)


def _refuse_repeated(records: list[Record], path: Path) -> None:
    """Raise if an episode is there twice: a harness has repeated episodes, or files were joined."""
    seen: set[Job] = set()
    for record in records:
        if record.identity in seen:
            raise InvalidValueError(
                f"{path} has {record.task}, {record.split} {record.episode}, more than once."
            )
        seen.add(record.identity)


_READERS: Mapping[str, Callable[[Path, ImportOptions], Iterator[Record]]] = {
    "lerobot": _read_lerobot,
    "vla-eval": _read_vla_eval,
    "inspect": _read_inspect,
    "jsonl": _read_lines,
}
