"""Bodies and readers: what is missing is trained, one after the other."""

from __future__ import annotations

from experiment.study import TRUTH, Study, show
from roboirg.language.settings import plain_settings
from roboirg.tasks import find_tasks
from roboirg.util.atomic_write import write_atomically
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.policy.policy_plan import BodyPlan
from roboirg_learn.policy.policy_training import trained_body_file, trained_reader_file


def train_missing(study: Study) -> None:
    """Train the bodies and readers that the results lack; each is there when it is finished.

    All share recordings and detector. An interrupted training goes on after its last pass.
    """
    tasks = find_tasks(study.tasks.split(","))
    for row in study.rows():
        if not row.body.exists():
            plan = BodyPlan(
                tasks,
                row.memory,
                study.scenes,
                study.drawn,
                study.detector_epochs,
                study.body_epochs,
                row.seed,
            )
            made = trained_body_file(plan, study.work, study.workers, show)
            write_atomically(row.body, made.read_bytes())
        if row.heard != TRUTH and not row.reader.exists():
            settings = plain_settings() if row.heard == "all" else (row.heard,)
            words = ReaderPlan(
                tasks,
                settings,
                scenes=study.scenes,
                reader_epochs=study.reader_epochs[row.heard],
                seed=row.seed,
            )
            made = trained_reader_file(row.body, words, study.work, study.workers, show)
            write_atomically(row.reader, made.read_bytes())
