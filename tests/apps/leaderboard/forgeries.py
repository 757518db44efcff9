"""Ways to make a run look better than it is."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from roboirg.evaluation.records.action_log import (
    ACTION_FOLDER,
    ActionLog,
    action_path,
    read_actions,
    write_actions,
)
from roboirg.evaluation.records.run_files import PLAN_FILE
from roboirg.evaluation.records.store import RECORDS_FILE

Lines = list[dict[str, Any]]
Forgery = Callable[[Lines, Path, random.Random], Lines | None]


def forge(folder: Path, forgery: Forgery, rng: random.Random) -> bool:
    """Change a run in place; return whether the forgery applies to it."""
    path = folder / RECORDS_FILE
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    before = copy.deepcopy(lines), _action_files(folder)
    forged = forgery(lines, folder, rng)
    if forged is None or (forged, _action_files(folder)) == before:
        return False
    path.write_text("".join(json.dumps(line) + "\n" for line in forged))
    return True


def _action_files(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / ACTION_FOLDER).rglob("*.npz"))


def _changes(**changes: Any) -> Forgery:
    def forgery(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
        rng.choice(lines).update(changes)
        return lines

    return forgery


def _flip(lines: Lines, _folder: Path, rng: random.Random) -> Lines | None:
    failed = [line for line in lines if line["outcome"] == "failure"]
    if not failed:
        return None
    rng.choice(failed).update(outcome="success", cause=None, attribution=None)
    return lines


def _fail(lines: Lines, _folder: Path, rng: random.Random) -> Lines | None:
    good = [line for line in lines if line["outcome"] == "success"]
    if not good:
        return None
    rng.choice(good).update(outcome="failure", cause="not done after 1300 steps")
    return lines


def _hide_as_error(lines: Lines, _folder: Path, rng: random.Random) -> Lines | None:
    failed = [line for line in lines if line["outcome"] == "failure"]
    if not failed:
        return None
    cause = "timeout: the policy took more than 600 s"
    rng.choice(failed).update(outcome="error", error="timeout", cause=cause, attribution=None)
    return lines


def _other_actions(lines: Lines, _folder: Path, rng: random.Random) -> Lines | None:
    one, other = rng.sample(lines, 2)
    if one["action_log"] == other["action_log"]:
        return None
    one.update(action_log=other["action_log"])
    return lines


def _other_episode_whole(lines: Lines, _folder: Path, rng: random.Random) -> Lines | None:
    """Pass off what happened in another episode, verdict, events and end state included."""
    one, other = rng.sample(lines, 2)
    names = ("action_log", "end_state", "events", "outcome", "cause", "attribution", "steps")
    if one["action_log"] == other["action_log"]:
        return None
    one.update({name: other[name] for name in names})
    return lines


def _relog(change: Callable[[ActionLog], ActionLog]) -> Forgery:
    def forgery(lines: Lines, folder: Path, rng: random.Random) -> Lines:
        one = rng.choice(lines)
        log = read_actions(folder, one["action_log"])
        one.update(action_log=write_actions(change(log), folder))
        return lines

    return forgery


def _cut(log: ActionLog) -> ActionLog:
    return ActionLog(log.space, log.rows[:-1], log.requests, log.end_state)


def _nudge(log: ActionLog) -> ActionLog:
    rows = log.rows.copy()
    rows[len(rows) // 2 :] += 0.001
    return ActionLog(log.space, rows, log.requests, log.end_state)


def _go_on(log: ActionLog) -> ActionLog:
    rows = log.rows[[*range(len(log.rows)), -1, -1]]
    return ActionLog(log.space, rows, log.requests, log.end_state)


def _invent_end(log: ActionLog) -> ActionLog:
    return ActionLog(log.space, log.rows, log.requests, log.end_state + 0.05)


def _lose_actions(lines: Lines, folder: Path, rng: random.Random) -> Lines:
    action_path(folder, rng.choice(lines)["action_log"]).unlink()
    return lines


def _say_otherwise(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
    said = rng.choice(lines)["instruction"]
    said[-1]["text"] = "Pick up the red cube and press the button."
    return lines


def _soften_goal(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
    goal = rng.choice(lines)["goal"]
    goal[next(iter(goal))] = "anything"
    return lines


def _drop_event(lines: Lines, _folder: Path, rng: random.Random) -> Lines | None:
    eventful = [line for line in lines if line["events"]]
    if not eventful:
        return None
    rng.choice(eventful)["events"].pop()
    return lines


def _double(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
    return [*lines, dict(rng.choice(lines))]


def _leave_out(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
    lines.remove(rng.choice(lines))
    return lines


def _leave_out_without_plan(lines: Lines, folder: Path, rng: random.Random) -> Lines:
    (folder / PLAN_FILE).unlink()
    return _leave_out(lines, folder, rng)


def _faster(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
    rng.choice(lines)["steps"] -= 1
    return lines


def _other_wordings(lines: Lines, _folder: Path, rng: random.Random) -> Lines:
    rng.choice(lines)["options"]["wordings"] = "others@12345678"
    return lines


FORGERIES: dict[str, Forgery] = {
    "failure to success": _flip,
    "success to failure": _fail,
    "failure to error": _hide_as_error,
    "cause": _changes(cause="the gripper slipped", outcome="failure"),
    "steps": _faster,
    "actions of another episode": _other_actions,
    "everything of another episode": _other_episode_whole,
    "actions cut": _relog(_cut),
    "actions changed": _relog(_nudge),
    "actions after the end": _relog(_go_on),
    "end state in numbers": _relog(_invent_end),
    "end state": _changes(end_state="0" * 64),
    "actions lost": _lose_actions,
    "no actions": _changes(action_log=None),
    "name of another file": _changes(action_log="../../plan"),
    "words": _say_otherwise,
    "goal": _soften_goal,
    "explicit command": _changes(command="Press the button."),
    "mentions": _changes(mentions=[]),
    "wordings": _other_wordings,
    "seed of the scene": _changes(seed=1),
    "difficulty": _changes(difficulty="hardest"),
    "version of the world": _changes(environment_version=0),
    "version of the words": _changes(language_version="0.9.0"),
    "demonstration": _changes(demonstration_steps=17),
    "events": _drop_event,
    "record doubled": _double,
    "record left out": _leave_out,
    "record left out, and the plan": _leave_out_without_plan,
    "policy's seed": _changes(policy_seed=99),
    "another episode of the split": _changes(episode=49),
    "no such episode": _changes(episode=5_000),
}
