"""Ways to alter a run, and what `verify` says of each."""

import json
import random

from roboirg.records.action_log import (
    ActionLog,
    action_path,
    read_actions,
    write_actions,
)
from roboirg.records.store import RECORDS_FILE


def forge(folder, forgery, seed=0):
    """Change a run in place."""
    path = folder / RECORDS_FILE
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    forged = forgery(lines, folder, random.Random(seed))
    path.write_text("".join(json.dumps(line) + "\n" for line in forged))


def _changes(of_outcome=None, /, **changes):
    """Change a record at random, or one with an outcome."""

    def forgery(lines, _folder, rng):
        of_kind = [line for line in lines if of_outcome in (None, line["outcome"])]
        rng.choice(of_kind).update(changes)
        return lines

    return forgery


def _other_actions(lines, _folder, rng):
    one, other = rng.sample(lines, 2)
    one.update(action_log=other["action_log"])
    return lines


def _relog(change):
    def forgery(lines, folder, rng):
        one = rng.choice(lines)
        log = read_actions(folder, one["action_log"])
        one.update(action_log=write_actions(change(log), folder))
        return lines

    return forgery


def _nudge(log):
    rows = log.rows.copy()
    rows[len(rows) // 2 :] += 0.001
    return ActionLog(log.space, rows, log.requests, log.end_state)


def _go_on(log):
    rows = log.rows[[*range(len(log.rows)), -1, -1]]
    return ActionLog(log.space, rows, log.requests, log.end_state)


def _cut(log):
    return ActionLog(log.space, log.rows[:-1], log.requests, log.end_state)


def _lose_actions(lines, folder, rng):
    action_path(folder, rng.choice(lines)["action_log"]).unlink()
    return lines


def _swap_files(lines, folder, rng):
    """Put the actions of one episode into the file of another."""
    one, other = (action_path(folder, line["action_log"]) for line in rng.sample(lines, 2))
    one.write_bytes(other.read_bytes())
    return lines


def _other_stage(lines, _folder, rng):
    rng.choice(lines)["instruction"][0]["stage"] = "cue"
    return lines


def _other_word(lines, _folder, rng):
    rng.choice(lines)["instruction"][-1]["text"] += " Please."
    return lines


LATE = "timeout: the policy took more than 600 s"

OTHER = {"kind": "execution", "failure": "unreachable", "sentence": "Could not."}

FORGERIES = {
    "failure to success": (
        _changes("failure", outcome="success", cause=None, attribution=None),
        "outcome: the record says 'success'; it should be 'failure'.",
    ),
    "success to failure": (
        _changes("success", outcome="failure", cause="not done after 1300 steps"),
        "outcome: the record says 'failure'; it should be 'success'.",
    ),
    "failure to error": (
        _changes("failure", outcome="error", error="timeout", cause=LATE, attribution=None),
        "outcome: the record says 'error'; it should be 'failure'.",
    ),
    "why it failed": (_changes("failure", attribution=OTHER), "attribution: the record says"),
    "attempts": (_changes(attempts=[]), "attempts, entry 1: the record says None"),
    "no attempts": (_changes(attempts=None), "attempts: the record says None"),
    "steps": (_changes(steps=1), "steps: the record says 1; it should be"),
    "events": (_changes("success", events=[]), "events, entry 1: the record says None"),
    "end state": (_changes(end_state="0" * 64), "the record says '000"),
    "actions changed": (_relog(_nudge), "end_state, entry"),
    "actions cut": (_relog(_cut), "the actions end before the episode does"),
    "actions after the end": (_relog(_go_on), "some of them come after the end of the episode"),
    "actions of another episode": (_other_actions, "end_state, entry"),
    "actions lost": (_lose_actions, ".npz are missing."),
    "another file of actions": (_swap_files, "does not have the content that its name gives"),
    "no actions": (_changes(action_log=None), "Its actions were not kept"),
    "explicit command": (_changes(command="Press the button."), "command: the record says"),
    "seed of the scene": (_changes(seed=1), "seed: the record says 1; it should be"),
    "version of the world": (_changes(environment_version=0), "environment_version: the record"),
    "version of the words": (_changes(language_version="0.9.0"), "language_version: the record"),
    "other stage": (
        _other_stage,
        "instruction, entry 1: the record says UtteranceRecord(stage='cue'",
    ),
    "another word": (_other_word, "the record says UtteranceRecord(stage='command'"),
    "no such episode": (_changes(episode=5_000), "There is no episode 5000"),
}
"""By name: the change, and a part of the sentence about it."""
