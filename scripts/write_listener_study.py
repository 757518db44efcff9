"""Write docs/learned-listener-results.md from the answers of a study.

python scripts/write_listener_study.py [FOLDER]  # of a study, whose answers are stored first
"""

from __future__ import annotations

import functools
import json
import lzma
import sys
from pathlib import Path

from written_parts import with_part

from roboirg_learn.listener.listener_study import StudyAnswer
from roboirg_learn.listener.study_report import (
    study_rates,
    tables_text,
)

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "learned-listener-results.md"
ANSWERS = ROOT / "results" / "listener-study-answers.jsonl.xz"


@functools.cache
def answers() -> tuple[StudyAnswer, ...]:
    """Return what every listener understood."""
    with lzma.open(ANSWERS, "rt", encoding="utf-8") as lines:
        return tuple(StudyAnswer(**json.loads(line)) for line in lines)


def page_text() -> str:
    """Return the page with the tables of the answers."""
    page = PAGE.read_text(encoding="utf-8")
    return with_part(page, "study", tables_text(study_rates(answers())))


def main() -> None:
    if sys.argv[1:]:
        files = sorted(Path(sys.argv[1]).glob("*-?.jsonl"))
        ANSWERS.write_bytes(lzma.compress(b"".join(path.read_bytes() for path in files)))
    PAGE.write_text(page_text(), encoding="utf-8")


if __name__ == "__main__":
    main()
