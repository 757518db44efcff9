"""How well failures are attributed whose cause is known: tables for docs/attribution-rates.md.

``python tests/judging/confusion.py`` writes them there, from the stored facts of each half, and the
names of failures into docs/attribution.md.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter, defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from cause_making import Course, read_courses

from roboirg.core.failures import FAILURE_KINDS, FAILURES
from roboirg.judging import DeclaredIntent, attribute_failure
from roboirg.stats.intervals import interval_of_values
from roboirg.tasks import get_task

HERE = Path(__file__).parent
DOCS = HERE.parents[1] / "docs"
NAMES_PAGE = DOCS / "attribution.md"
RATES_PAGE = DOCS / "attribution-rates.md"
HALVES = {
    "development": HERE / "made_failures.jsonl.xz",
    "held back": HERE / "held_back.jsonl.xz",
    "held back later": HERE / "held_back_later.jsonl.xz",
}
UNSCORED = "unscored"


class Scores(NamedTuple):
    """How often the kind was right, as shares.

    Attributes:
        of_decided: of the failures that were made by grounding or execution and are decided.
        of_causes: the mean over causes of the share of each that is right.
        interval: of `of_decided`, 95 %, from a bootstrap over causes.
        undecided: share of these failures that are not decided.
        kept_undecided: share of idle, trembling and stopped hands that are undecided.
    """

    of_decided: float
    of_causes: float
    interval: tuple[float, float]
    undecided: float
    kept_undecided: float


def attribute(course):
    said = course.declared
    return attribute_failure(
        course.episode,
        course.events,
        timed_out=course.status == "timeout",
        policy_start_step=course.start,
        elapsed_steps=course.elapsed,
        cause=course.words if course.status == "failure" else None,
        attempts=course.attempts,
        intent=None if said is None else DeclaredIntent(True, said["understood"]),
    )


class Pair(NamedTuple):
    """A course that failed, or had to succeed, with the kind and the name that it gets."""

    course: Course
    kind: str
    failure: str

    @property
    def is_right(self):
        return self.kind == self.course.kind


def pairs(courses):
    """Return the pair of each course that failed, or had to succeed."""
    found = []
    for course in courses:
        attribution = attribute(course)
        if attribution is not None:
            found.append(Pair(course, attribution.kind, attribution.failure))
        elif course.kind == "success":
            found.append(Pair(course, "success", ""))
    return found


def share_undecided(found):
    return sum(pair.kind == "undecided" for pair in found) / max(len(found), 1)


def scores(found):
    """Return how often the kind is right of some pairs."""
    shown = defaultdict(list)  # by cause
    silent = []
    for pair in found:
        course = pair.course
        if course.kind in ("grounding", "execution"):
            shown[course.cause].append(pair)
        if course.kind == "undecided" and course.failure != "no_answer":
            silent.append(pair)

    causes = sorted(shown)
    rights = []
    decided = []
    for cause in causes:
        kinds = [pair.is_right for pair in shown[cause] if pair.kind != "undecided"]
        rights.append(sum(kinds))
        decided.append(len(kinds))

    def share(numbers):
        return np.take(rights, numbers).sum() / max(np.take(decided, numbers).sum(), 1)

    rng = np.random.default_rng(0)
    count = len(causes)
    drawn = [share(rng.choice(count, count)) for _ in range(1000)]
    low, high = np.percentile(drawn, [2.5, 97.5])
    if low == high:
        low, high = interval_of_values([[low] * count])
    by_cause = [np.mean([pair.is_right for pair in shown[cause]]) for cause in causes]
    return Scores(
        float(share(range(count))),
        float(np.mean(by_cause)),
        (float(low), float(high)),
        share_undecided([*itertools.chain.from_iterable(shown.values())]),
        share_undecided(silent),
    )


class Tally(NamedTuple):
    """How many failures of a name were made, and of how many kind and name are right."""

    made: int
    kinds: int
    names: int


def classes(found):
    """Return what is right of each name that was made, of some pairs."""
    by_name = defaultdict(list)
    for pair in found:
        if pair.course.failure is not None and pair.course.kind != UNSCORED:
            by_name[pair.course.failure].append(pair)
    tallies = {}
    for name, made in by_name.items():
        kinds = sum(pair.is_right for pair in made)
        names = sum(pair.failure == name for pair in made)
        tallies[name] = Tally(len(made), kinds, names)
    return tallies


def percent(share):
    return f"{100 * share:.0f} %"


def table(found):
    """Return the confusion of kinds, the scores, and the names, of some pairs."""
    lines = [*kinds_table(found), "", summary(found), ""]
    lines.append("| made | failures | kind right | name right |")
    lines.append("| --- | ---: | ---: | ---: |")
    tallies = classes(found)
    for name in FAILURES:
        if name in tallies:
            made, kinds, names = tallies[name]
            shares = f"{percent(kinds / made)} | {percent(names / made)}"
            lines.append(f"| `{name}` | {made} | {shares} |")
    return "\n".join(lines)


def kinds_table(found):
    """Return lines of a table: how often what was made is found as each kind."""
    kinds = [*FAILURE_KINDS, "success"]
    counts = Counter((pair.course.kind, pair.kind) for pair in found)
    heads = " | ".join(f"found {kind}" for kind in kinds)
    lines = [f"| made | {heads} |", "| --- | " + "---: | " * 4]
    for made in (*kinds, UNSCORED):
        numbers = [counts[made, kind] for kind in kinds]
        if any(numbers):
            lines.append(f"| {made} | {' | '.join(map(str, numbers))} |")
    return lines


def summary(found):
    """Return the scores in sentences."""
    causes = len({pair.course.cause for pair in found})
    share = scores(found)
    low, high = share.interval
    return (
        f"{len(found)} episodes of {causes} causes. Kind right: {percent(share.of_decided)} of "
        f"the decided (95 % interval over causes {100 * low:.0f} to {100 * high:.0f}), "
        f"{percent(share.of_causes)} as the mean over causes. Not decided, though acts show "
        f"it: {percent(share.undecided)}. Idle, trembling and stopped hands that stay "
        f"undecided: {percent(share.kept_undecided)}. Found grounding and made so, in counting "
        f"tasks: {precisions(found)}."
    )


def precisions(found):
    """Return the share of what is found grounding that was made so, in each counting task."""
    rights = defaultdict(list)
    for pair in found:
        task = pair.course.where[0]
        is_known = pair.kind == "grounding" and pair.course.kind != UNSCORED
        if is_known and get_task(task).suite == "counting":
            rights[task].append(pair.is_right)
    return ", ".join(f"{task} {percent(np.mean(right))}" for task, right in rights.items())


def failures_table():
    """The names of failures as the documentation shows them."""
    rows = ["| kind | failure | the policy | for example |", "| --- | --- | --- | --- |"]
    rows += [
        f"| {failure.kind} | `{name}` | {failure.meaning} | {failure.example} |"
        for name, failure in FAILURES.items()
    ]
    return "\n".join(rows)


def put_in(document, mark, text):
    """Return a document with the text between two marks replaced."""
    begin = f"<!-- {mark} -->"
    end = f"<!-- end of {mark} -->"
    pattern = re.compile(rf"{re.escape(begin)}.*{re.escape(end)}", re.DOTALL)
    return pattern.sub(lambda _: f"{begin}\n\n{text}\n\n{end}", document)


def main():
    NAMES_PAGE.write_text(put_in(NAMES_PAGE.read_text(), "failures", failures_table()))
    rates = RATES_PAGE.read_text()
    for half, path in HALVES.items():
        rates = put_in(rates, half, table(pairs(read_courses(path))))
    RATES_PAGE.write_text(rates)


if __name__ == "__main__":
    main()
