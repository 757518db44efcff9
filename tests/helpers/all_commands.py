"""All commands, with words for each with which it does its work."""

from functools import cache

import layout
import typer.main
from made_records import make_record
from msgspec.structs import replace
from plan_files import plan_file

from roboirg.core.instruction_options import InstructionOptions
from roboirg.main import app
from roboirg.records.record import Job
from roboirg.records.store import RecordStore
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import write_plan

WORDS = {
    "run": "--policy random --tasks PickXtimes --episodes 1 --workers 0 --settings explicit"
    " --out {folder}/out",
    "records merge": "{run} --out {folder}/merged",
    "report": "{run}",
    "tables": "{run}",
    "figures": "{run} --out {folder}/figures",
    "compare": "{run}:random {run}:oracle",
    "serve": "random",
    "check-policy": "random",
    "doctor": "",
    "fetch-models": "--help",
    "tasks": "",
    "show": "PickXtimes 0 --out {folder}/sheet.png",
    "language sample": "--out {folder}/rating --tasks StopCube --settings direct",
    "language check-scenarios": "{scenarios} --scenario students --seeds 0",
    "language stats": "--tasks PickXtimes --split val",
    "language shortcuts": "--tasks StopCube --settings direct --learned",
    "export instructions": "--tasks PickXtimes --split val --out {folder}/words.jsonl",
    "export episodes": "--tasks PickXtimes --split val --out {folder}/episodes.jsonl",
    "export demonstrations": "--tasks StopCube --episodes 1 --pictures none --settings explicit"
    " --workers 0 --out {folder}/moves",
    "export grounding": "--tasks StopCube --plan {one_episode} --settings explicit"
    " --out {folder}/questions",
    "export hub-results": "--help",
    "replay": "--help",
    "score grounding": "--help",
    "learn listener": "--help",
    "learn policy": "--help",
    "learn reader": "--help",
    "leaderboard pack": "{run} --out {folder}/packed.zip",
    "leaderboard verify": "--help",
    "real plan": "--policy random --tasks PutInBox --trials 1 --demonstrations 1"
    " --out {folder}/study",
    "real score": "{folder}/study",
    "language import-robomme": "--help",
}
"""Words for each command with which it does its work where all is installed; see `words_of`."""


@cache
def all_commands():
    """Return the commands by their words."""

    def walk(command, name):
        for word, inner in getattr(command, "commands", {}).items():
            yield from walk(inner, [*name, word])
        if not hasattr(command, "commands"):
            yield " ".join(name), command

    return dict(walk(typer.main.get_command(app), []))


def make_run(folder):
    """Write a run of two policies, one of which succeeds, and return its folder."""
    with RecordStore(folder) as store:
        for number in range(6):
            job = Job(
                policy="random",
                task="PickXtimes",
                split="test",
                episode=number // 2,
                options=InstructionOptions("direct"),
            )
            outcome = ("success",) if number % 2 else ("failure", "timeout")
            job = replace(job, policy="oracle") if number % 2 else job
            store.append(make_record(job, *outcome, steps=7))
    plan = make_plan(["random", "oracle"], tasks="PickXtimes", settings="direct", episodes="3")
    write_plan(plan, folder)
    return folder


def words_of(folder, run):
    """Return `WORDS` for files in a folder and a run; the plan files are written."""
    paths = {
        "folder": folder,
        "run": run,
        "one_episode": plan_file(episodes=1),
        "scenarios": layout.PACKAGE / "language" / "scenarios" / "StopCube.toml",
    }
    return {
        name: [word.format_map(paths) for word in words.split()] for name, words in WORDS.items()
    }
