"""An export of synthetic trajectories, to be killed: ``python killed_export.py OUT WORKERS``."""

import sys
import time
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


def say(word):
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


def slowly(function):
    """Give a kill time to hit in the middle."""

    def call(*args, **options):
        time.sleep(0.05)
        return function(*args, **options)

    return call


def main():
    export_run.record_trajectory = slowly(synthetic_trajectories.record)
    export_run.choose_policy = lambda job: None
    say("started")
    export_run.run_export(PLAN, Path(sys.argv[1]), 0, lambda *_: None)
    say("finished")


if __name__ == "__main__":
    main()
