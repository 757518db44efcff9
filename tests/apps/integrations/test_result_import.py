"""Results of other harnesses become records that tables read."""

import contextlib
import json
import os
import sqlite3

import msgspec
import pytest
from msgspec.structs import replace
from typer.testing import CliRunner

from roboirg.apps.integrations.result_import import ImportOptions, import_results
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.records.record import Job
from roboirg.evaluation.records.store import read_records
from roboirg.main import app

OPTIONS = ImportOptions("theirs")


def lerobot_file(folder, successes=(True, False, True), group="VideoUnmask-spatial-test"):
    entry = {"task_group": group, "task_id": 0, "metrics": {"successes": list(successes)}}
    path = folder / "eval_info.json"
    path.write_text(json.dumps({"per_task": [entry], "overall": {}}))
    return path


def test_lerobot_s_seeds_become_episodes(tmp_path):
    path = lerobot_file(tmp_path)
    assert import_results("lerobot", path, tmp_path / "run", OPTIONS._replace(seed=1049)) == 3
    records = read_records(tmp_path / "run")
    assert [(one.episode, one.outcome) for one in records] == [
        (49, "success"), (0, "failure"), (1, "success"),
    ]  # fmt: skip
    assert {(one.task, one.setting, one.split, one.policy) for one in records} == {
        ("VideoUnmask", "spatial", "test", "theirs")
    }
    failure = records[1]
    assert failure.cause == "the harness does not report the cause"
    assert failure.attribution is None
    imported = failure.policy_metadata["imported"]
    assert (imported["from"], imported["file"]) == ("lerobot", "eval_info.json")
    assert {"events", "steps", "cause", "attribution"} <= set(imported["lacks"])


def vla_eval_file(folder):
    path = folder / "recording-first.sqlite"
    config = {"params": {"setting": "direct", "action_space": "ee_pose", "tasks": ["PickXtimes"]}}
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        database.execute("CREATE TABLE eval_metadata (eval_id, safe_name, metadata)")
        database.execute(
            "INSERT INTO eval_metadata VALUES ('first-1', '1', ?)",
            (json.dumps({"config": config}),),
        )
        database.execute(
            "CREATE TABLE episode_results (sid, eid, eval_id, task_name, episode_id, status,"
            " metrics, steps, elapsed_sec, context, jsonl_path, failure_reason, failure_detail)"
        )
        for index, (status, reason, detail) in enumerate(
            [
                ("success", None, None),
                ("fail", None, None),
                ("error", "timeout", "timeout=30s"),
                ("error", "env_step", "InvalidActionError: not finite"),
                ("error", "env_start", "boom"),
            ]
        ):
            database.execute(
                "INSERT INTO episode_results VALUES ('s', ?, 'first-1', 'PickXtimes', ?, ?, '{}',"
                " 120, 9.5, ?, '', ?, ?)",
                (str(index), index, status, json.dumps({"episode_idx": index}), reason, detail),
            )
    return path


def test_vla_eval_s_errors_are_no_failures(tmp_path):
    import_results("vla-eval", vla_eval_file(tmp_path), tmp_path / "run", OPTIONS)
    records = read_records(tmp_path / "run")
    assert [(one.outcome, one.error) for one in records] == [
        ("success", None), ("failure", None), ("error", "timeout"),
        ("error", "invalid_action"), ("error", "environment"),
    ]  # fmt: skip
    assert {(one.setting, one.actions, one.steps, one.duration_s) for one in records} == {
        ("direct", "ee_pose", 120, 9.5)
    }


def test_inspect_s_logs_hold_whole_records(tmp_path):
    source = tmp_path / "played"
    import_results("lerobot", lerobot_file(tmp_path), source, OPTIONS)
    records = read_records(source)
    job = Job(
        policy="x",
        task="PickXtimes",
        split="test",
        episode=4,
        options=InstructionOptions("contextual"),
    )
    samples = [
        {"scores": {"grounds_reference": {"metadata": {"record": msgspec.to_builtins(one)}}}}
        for one in records
    ]
    error = {"message": "the model is busy", "traceback": "Traceback"}
    samples.append({"metadata": {"job": msgspec.to_builtins(job)}, "error": error})
    log = tmp_path / "log.json"
    log.write_text(json.dumps({"samples": samples}))
    import_results("inspect", log, tmp_path / "run", ImportOptions("gpt"))
    *whole, lost = read_records(tmp_path / "run")
    assert [replace(one, policy="theirs") for one in whole] == list(records)
    assert (lost.outcome, lost.task, lost.episode) == ("error", "PickXtimes", 4)
    assert lost.cause == "environment: the model is busy"


def test_lines_of_one_s_own_become_records(tmp_path):
    path = tmp_path / "verdicts.jsonl"
    first = {"task": "PickXtimes", "episode": 3, "success": True, "steps": 7, "setting": "direct"}
    path.write_text(json.dumps(first) + '\n{"task": "StopCube", "episode": 0, "success": false}\n')
    import_results("jsonl", path, tmp_path / "run", OPTIONS)
    one, other = read_records(tmp_path / "run")
    assert (one.setting, one.episode, one.outcome, one.steps) == ("direct", 3, "success", 7)
    assert (other.setting, other.split, other.outcome) == ("explicit", "test", "failure")
    assert "steps" in other.policy_metadata["imported"]["lacks"]
    path.write_text('{"task": "StopCube", "episode": 0, "success": 1}')
    with pytest.raises(InvalidValueError, match=r"line 1: success is 1; it must be true or false"):
        import_results("jsonl", path, tmp_path / "other", OPTIONS)
    path.write_text('{"task": "StopCube", "success": true}')
    with pytest.raises(InvalidValueError, match="required field `episode`"):
        import_results("jsonl", path, tmp_path / "other", OPTIONS)
    path.write_text('{"task": "StopCube", "episode": 0, "success": true, "colour": 1}')
    with pytest.raises(InvalidValueError, match="colour"):
        import_results("jsonl", path, tmp_path / "other", OPTIONS)


def test_tables_read_imported_records(tmp_path):
    path, run = lerobot_file(tmp_path), tmp_path / "run"
    runner = CliRunner()
    made = runner.invoke(
        app,
        ["records", "import", "lerobot", str(path), "--out", str(run), "--policy", "smolvla",
         "--set", "max_steps=900"],
        catch_exceptions=False,
    )  # fmt: skip
    assert made.output.strip() == f"3 records in {run}"
    assert {one.max_steps for one in read_records(run)} == {900}
    shown = runner.invoke(app, ["tables", str(run), "--format", "csv"], catch_exceptions=False)
    assert "smolvla" in shown.output


def test_wrong_files_are_refused_in_a_sentence(tmp_path):
    path = lerobot_file(tmp_path)
    with pytest.raises(UnknownNameError, match="no harness 'lerobt'"):
        import_results("lerobt", path, tmp_path / "run", OPTIONS)
    with pytest.raises(InvalidValueError, match="is not a results file of vla-eval"):
        import_results("vla-eval", path, tmp_path / "run", OPTIONS)
    with pytest.raises(InvalidValueError, match="There is no file"):
        import_results("vla-eval", tmp_path / "none.sqlite", tmp_path / "run", OPTIONS)
    with pytest.raises(InvalidValueError, match="cannot be read"):
        import_results("inspect", tmp_path / "none.json", tmp_path / "run", OPTIONS)
    with pytest.raises(InvalidValueError, match="inspect log convert"):
        import_results("inspect", tmp_path / "a.eval", tmp_path / "run", OPTIONS)
    with pytest.raises(InvalidValueError, match="'pusht' is not a task group of this benchmark"):
        import_results("lerobot", lerobot_file(tmp_path, group="pusht"), tmp_path / "r", OPTIONS)
    many = lerobot_file(tmp_path, [True] * 51)
    with pytest.raises(InvalidValueError, match="VideoUnmask, test 0, more than once"):
        import_results("lerobot", many, tmp_path / "run", OPTIONS)
    runner = CliRunner()
    wrong = runner.invoke(
        app,
        ["records", "import", "lerobot", str(path), "--out", str(tmp_path / "run"), "--policy", "x",
         "--set", "colour=red"],
    )  # fmt: skip
    assert "no field 'colour'" in str(wrong.exception)


EPISODE = b'{"task": "PickXtimes", "episode": 0, "success": false, "steps": %s}'


@pytest.mark.parametrize("harness", ["jsonl", "lerobot", "inspect"])
@pytest.mark.parametrize(
    "content",
    [b"[" * 100_000, b"\xff\xfe", b'{"a": ' + b"9" * 10_000 + b"}"],
    ids=["deep nesting", "no UTF-8", "10,000 digits"],
)
def test_files_that_are_no_results_are_refused(harness, content, tmp_path):
    (tmp_path / "results").write_bytes(content)
    with pytest.raises(InvalidValueError, match="is not a results file of"):
        import_results(harness, tmp_path / "results", tmp_path / "run", OPTIONS)


@pytest.mark.parametrize("steps", [b"NaN", b"1e400", b"[1]", b"9" * 5_000])
def test_numbers_of_steps_that_cannot_be_are_refused(steps, tmp_path):
    (tmp_path / "results").write_bytes(EPISODE % steps)
    with pytest.raises(InvalidValueError, match="results"):
        import_results("jsonl", tmp_path / "results", tmp_path / "run", OPTIONS)


@pytest.mark.parametrize("harness", ["jsonl", "lerobot", "inspect"])
def test_devices_and_pipes_are_not_read(harness, tmp_path):
    (tmp_path / "device").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    for name in ("device", "pipe"):
        with pytest.raises(InvalidValueError, match="not a regular file"):
            import_results(harness, tmp_path / name, tmp_path / "run", OPTIONS)
