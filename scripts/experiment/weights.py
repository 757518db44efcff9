"""Bodies and readers: what is missing is trained, several at once."""

from __future__ import annotations

from functools import partial

from experiment.study import TRUTH, Row, Study, show
from roboirg.language.settings import plain_settings
from roboirg.tasks import find_tasks
from roboirg.util.atomic_write import write_atomically
from roboirg.util.parallel_map import parallel_map
from roboirg_learn.learn_support import check_learn_support
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.policy.policy_plan import BodyPlan
from roboirg_learn.policy.policy_training import (
    prepare_bodies,
    trained_body_file,
    trained_reader_file,
)
from roboirg_learn.trainer import part_of


def train_missing(study: Study) -> None:
    """Train the bodies and readers that the results lack; each is there when it is finished.

    All share recordings and detector, which are made first. Then every worker trains one network at
    a time; a reader learns with the last body that it is wanted for. An interrupted training goes
    on after its last pass.
    """
    rows = study.rows()
    bodies = {row.body: row for row in rows if not row.body.exists()}
    if bodies:
        prepare_bodies(_body_plan(study, rows[0]), study.work, study.workers, show)
    list(parallel_map(partial(_train_body, study), list(bodies.values()), study.workers))
    heard = [row for row in rows if row.heard != TRUTH]
    readers = {row.reader: row for row in heard if not row.reader.exists()}
    list(parallel_map(partial(_train_reader, study), list(readers.values()), study.workers))


def _body_plan(study: Study, row: Row) -> BodyPlan:
    """Return how the body of a row learns."""
    return BodyPlan(
        find_tasks(study.tasks.split(",")),
        row.memory,
        study.scenes,
        study.drawn,
        study.detector_epochs,
        study.body_epochs,
        row.seed,
    )


def _train_body(study: Study, row: Row) -> None:
    """Train the body of a row; runs in worker processes."""
    check_learn_support()
    progress = part_of(show, f"{row.memory}-{row.seed}")
    made = trained_body_file(_body_plan(study, row), study.work, 0, progress)
    write_atomically(row.body, made.read_bytes())


def _train_reader(study: Study, row: Row) -> None:
    """Train the reader of a row; runs in worker processes."""
    check_learn_support()
    words = ReaderPlan(
        find_tasks(study.tasks.split(",")),
        plain_settings() if row.heard == "all" else (row.heard,),
        scenes=study.scenes,
        reader_epochs=study.reader_epochs[row.heard],
        seed=row.seed,
    )
    progress = part_of(show, f"{row.heard}-{row.seed}")
    made = trained_reader_file(row.body, words, study.work, 0, progress)
    write_atomically(row.reader, made.read_bytes())
