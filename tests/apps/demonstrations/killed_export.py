"""An export of synthetic trajectories, killed before a file appears: ``killed_export.py OUT LAST``.

LAST is the number of the file, from 1 on; an export of fewer files ends.
"""

import itertools
import os
import signal
import sys
from pathlib import Path

import synthetic_trajectories

from roboirg.apps.demonstrations import export_run
from roboirg.apps.demonstrations.export_plan import ExportPlan

PLAN = ExportPlan(
    tasks=("PickXtimes", "VideoUnmask"),
    split="train",
    episodes=(0, 1, 2, 3),
    settings=("explicit", "direct"),
    video=True,
)


def main(out, last):
    replace = Path.replace
    files = itertools.count(1)

    def killed(part, path):
        if next(files) == last:
            os.kill(os.getpid(), signal.SIGKILL)
        return replace(part, path)

    Path.replace = killed
    export_run.record_trajectory = synthetic_trajectories.record
    export_run.choose_policy = lambda job: None
    export_run.run_export(PLAN, out, 0, lambda *_: None)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
