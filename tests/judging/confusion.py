"""How well failures are attributed whose cause is known: tables for docs/attribution.md.

``python tests/judging/confusion.py`` writes them there, from the stored facts of each half.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from cause_making import Course, read_courses

from roboirg.core.failures import FAILURE_KINDS, FAILURES
from roboirg.judging import DeclaredIntent, FailureAttribution, attribute_failure
from roboirg.stats.intervals import without_spread

HERE = Path(__file__).parent
DOCUMENT = HERE.parents[1] / "docs" / "attribution.md"
HALVES = {"development": HERE / "made_failures.jsonl.xz", "held back": HERE / "held_back.jsonl.xz"}
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


def attribute(course: Course) -> FailureAttribution | None:
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


def pairs(courses: Sequence[Course]) -> list[tuple[Course, str, str]]:
    """Courses that failed, or had to succeed, with the kind and the name that they get."""
    found = [(course, attribute(course)) for course in courses]
    return [
        (course, one.kind if one else "success", one.failure if one else "")
        for course, one in found
        if one is not None or course.kind == "success"
    ]


def scores(courses: Sequence[Course]) -> Scores:
    made = pairs(courses)
    shown = [(c.cause, c.kind, kind) for c, kind, _ in made if c.kind in ("grounding", "execution")]
    silent = [kind for c, kind, _ in made if c.kind == "undecided" and c.failure != "no_answer"]
    causes = sorted({cause for cause, *_ in shown})

    def share(chosen: Sequence[str]) -> float:
        kinds = [pair for one in chosen for cause, *pair in shown if cause == one]
        decided = [made == found for made, found in kinds if found != "undecided"]
        return sum(decided) / max(len(decided), 1)

    rng = np.random.default_rng(0)
    drawn = [share(rng.choice(causes, len(causes))) for _ in range(1000)]
    low, high = np.percentile(drawn, [2.5, 97.5])
    if low == high:
        low, high = without_spread(low, len(causes))
    by_cause = [[a == b for cause, a, b in shown if cause == one] for one in causes]
    return Scores(
        share(causes),
        float(np.mean([np.mean(one) for one in by_cause])),
        (float(low), float(high)),
        sum(kind == "undecided" for *_, kind in shown) / len(shown),
        sum(kind == "undecided" for kind in silent) / max(len(silent), 1),
    )


def classes(courses: Sequence[Course]) -> dict[str, tuple[int, int, int]]:
    """For each name that was made: how many, of how many the kind is right, and the name."""
    found: dict[str, tuple[int, int, int]] = {}
    for course, kind, name in pairs(courses):
        if course.failure is not None and course.kind != UNSCORED:
            many, kinds, names = found.get(course.failure, (0, 0, 0))
            right = kind == course.kind
            found[course.failure] = many + 1, kinds + right, names + (name == course.failure)
    return found


def table(courses: Sequence[Course]) -> str:
    """The confusion of kinds, the scores, and the names."""
    made = pairs(courses)
    kinds = [*FAILURE_KINDS, "success"]
    counts = Counter((course.kind, kind) for course, kind, _ in made)
    lines = [
        f"| made | {' | '.join(f'found {kind}' for kind in kinds)} |",
        "| --- | " + "---: | " * 4,
    ]
    for kind in (*kinds, UNSCORED):
        if any(counts[kind, other] for other in kinds):
            cells = " | ".join(str(counts[kind, other]) for other in kinds)
            lines.append(f"| {kind} | {cells} |")
    one = scores(courses)
    percent = "{:.0f} %".format
    low, high = one.interval
    causes = len({course.cause for course, *_ in made})
    summary = (
        f"{len(made)} episodes of {causes} causes. Kind right: {percent(100 * one.of_decided)} of "
        f"the decided (95 % interval over causes {100 * low:.0f} to {100 * high:.0f}), "
        f"{percent(100 * one.of_causes)} as the mean over causes. Not decided, though acts show "
        f"it: {percent(100 * one.undecided)}. Idle, trembling and stopped hands that stay "
        f"undecided: {percent(100 * one.kept_undecided)}."
    )
    lines += ["", summary, "", "| made | failures | kind right | name right |"]
    lines.append("| --- | ---: | ---: | ---: |")
    found = classes(courses)
    for name in [name for name in FAILURES if name in found]:
        many, right, names = found[name]
        lines.append(
            f"| `{name}` | {many} | {percent(100 * right / many)} | {percent(100 * names / many)} |"
        )
    return "\n".join(lines)


def failures_table() -> str:
    """The names of failures as the documentation shows them."""
    rows = ["| kind | failure | the policy | for example |", "| --- | --- | --- | --- |"]
    rows += [
        f"| {one.kind} | `{name}` | {one.meaning} | {one.example} |"
        for name, one in FAILURES.items()
    ]
    return "\n".join(rows)


def put_in(document: str, mark: str, text: str) -> str:
    """Return a document with the text between two marks replaced."""
    begin, end = f"<!-- {mark} -->", f"<!-- end of {mark} -->"
    pattern = re.compile(rf"{re.escape(begin)}.*{re.escape(end)}", re.DOTALL)
    return pattern.sub(lambda _: f"{begin}\n\n{text}\n\n{end}", document)


def main() -> None:
    document = put_in(DOCUMENT.read_text(), "failures", failures_table())
    for half, path in HALVES.items():
        if path.exists():
            document = put_in(document, half, table(read_courses(path)))
    DOCUMENT.write_text(document)


if __name__ == "__main__":
    main()
