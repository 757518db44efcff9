"""Attribute the failures of stored packs again: stores attempts and attributions in them.

python scripts/attribute_packs.py results/*.roboirg.zip

Plays the actions of each distinct play once, to see what was tried, in two processes: about an hour
for the published packs. What was seen is kept in build/attributed, so the command can be stopped,
and rules of attribution can change without playing again; delete that folder after a change of what
attempts are. Stops at a record whose events do not lead to its goals; a pack is replaced when all
of its records are done. Prints how the episodes of each pack ended.

A planner's subgoals are named again at the same steps, with pictures for what they point at, and
judged by today's rules. That takes another half an hour.
"""

from __future__ import annotations

import functools
import sys
from pathlib import Path

from roboirg.apps.leaderboard.action_replay import ReplayPolicy, job_of, replay
from roboirg.apps.leaderboard.packing import pack_run
from roboirg.core.errors import RoboIRGError
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.evaluation.analysis.results.reading import read_frame
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.diagnostic_tables import make_failure_table
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.play.call_guard import CallGuard
from roboirg.evaluation.play.episode_record import begin_record, conclude
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.rollout import play_with
from roboirg.evaluation.records.action_log import ActionLog, read_actions
from roboirg.evaluation.records.packs import opened_run
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.record_codec import encode, read_record, read_summary
from roboirg.evaluation.records.store import RECORDS_FILE
from roboirg.util.atomic_write import write_atomically
from roboirg.util.parallel_map import parallel_map
from roboirg.util.short_hash import short_hash

PLAYED = Path(__file__).parents[1] / "build" / "attributed"


class NamingPolicy(ReplayPolicy):
    """Answers and names what a planner answered and named.

    Args:
        log: the answers.
        stored: the record with the subgoals.
        again: the record of this play, which counts its steps.
    """

    def __init__(self, log: ActionLog, stored: Record, again: Record) -> None:
        super().__init__(log)
        self._stored, self._again = stored, again

    @property
    def subgoal(self) -> str | None:
        """The last subgoal; None before the first."""
        named = [one.text for one in self._stored.subgoals if one.step <= self._again.steps]
        return named[-1] if named else None


def play_again(record: Record, log: ActionLog) -> Record:
    """Return the record that the actions and subgoals of a record lead to."""
    if not record.subgoals:
        return replay(record, log)[0]
    prepared = PreparedJob(job_of(record))
    again = begin_record(prepared)
    policy = NamingPolicy(log, record, again)
    needs = PolicyNeeds(cameras=("front",), actions=log.space)
    play_with(policy, prepared, needs, again, CallGuard(again.timings, None)).conclude()
    return again


def attributed(line: bytes, folder: Path) -> bytes:
    """Return the line of a record with its attempts and today's attribution.

    Without attempts where the play's events are others here: another processor may have made them.

    Raises:
        RoboIRGError: its events do not lead to the goals that it says.
    """
    record = read_record(line, folder / RECORDS_FILE, 1)
    said, goals = [[one.step, one.text] for one in record.subgoals], record.goals
    if record.action_log is None or goals is None:
        return line  # an error
    named = f"-{short_hash(str(said))}" if said else ""
    path = PLAYED / f"{record.action_log}-{record.arm}{named}.json"
    if not path.exists():
        write_atomically(path, encode(play_again(record, read_actions(folder, record.action_log))))
    again = read_record(path.read_bytes(), path, 1)
    if again.events == record.events:
        record.attempts = again.attempts
        if [[one.step, one.text] for one in again.subgoals] == said:
            record.subgoals = again.subgoals
    conclude(
        record,
        PreparedJob(job_of(record)),
        -min(one.step for one in record.events),
        timed_out=(record.cause or "").startswith("not done after"),
        original=goals.original,
    )
    if record.goals != goals:
        raise RoboIRGError(f"{record.slug}: its events do not lead to the goals that it says.")
    return encode(record)


def main(*packs: str) -> None:
    """Attribute the failures of packs."""
    for pack in map(Path, packs):
        with opened_run(pack) as folder:
            path, work = folder / RECORDS_FILE, functools.partial(attributed, folder=folder)
            lines = path.read_bytes().splitlines()
            plays = {read_summary(line, path, 1).action_log: line for line in lines}
            # First a record of each play, so that none is played by both processes.
            found = {
                line: attributed_line
                for batch in ([*plays.values()], lines)
                for line, attributed_line in parallel_map(work, batch, 2)
            }
            path.write_bytes(b"".join(found[line] + b"\n" for line in lines))
            pack_run(folder, pack, videos=True, logs=True)
            frame = read_frame([Source(folder)])
        print(markdown(make_failure_table(RunData(frame), means=True)), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
