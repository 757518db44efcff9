"""Train, hear and play the paper's experiment on the small body, and write its tables.

python scripts/play_experiment.py
python scripts/play_experiment.py hear play --memories recurrent --seeds 0 --tasks PickXtimes

Whatever is killed goes on with the same command. docs/learned-policy.md describes the study.
"""

from __future__ import annotations

import argparse
import resource
import sys
from pathlib import Path

import yaml
from experiment.frame import prove, write_frame
from experiment.hearing import hear_missing
from experiment.packs import write_pack
from experiment.playing import play_missing
from experiment.study import Study
from experiment.weights import train_missing

from roboirg.core.errors import RoboIRGError
from roboirg.util.atomic_write import locked
from roboirg_learn.learn_support import check_learn_support

STEPS = {
    "train": train_missing,
    "hear": hear_missing,
    "play": play_missing,
    "frame": write_frame,
    "prove": prove,
    "pack": write_pack,
}
USUAL = ("train", "hear", "play", "frame", "prove")
PLAN = Path(__file__).parent / "experiment" / "study.yaml"


def main() -> None:
    """Do the steps that are named, or the usual ones; what is typed replaces what the plan says."""
    parser = argparse.ArgumentParser(description="Play the paper's experiment on the small body.")
    parser.add_argument(
        "steps", nargs="*", help=f"of {', '.join(STEPS)}; without any: {', '.join(USUAL)}"
    )
    parser.add_argument("--plan", type=Path, default=PLAN)
    for name in Study.model_fields:
        parser.add_argument(f"--{name}")
    options = vars(parser.parse_args())
    steps = options.pop("steps") or USUAL
    path = options.pop("plan")
    plan = {"name": path.stem, **yaml.safe_load(path.read_text(encoding="utf-8"))}
    for name, value in options.items():
        if value is not None:
            plan[name] = value
    try:
        check_learn_support()
        study = Study.model_validate(plan)
        with locked(study.work / ".lock", "Another command plays this study."):
            for step in steps:
                STEPS[step](study)
    except (RoboIRGError, ValueError) as error:
        sys.exit(str(error))
    seconds = 0.0
    for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
        used = resource.getrusage(who)
        seconds += used.ru_utime + used.ru_stime
    print(f"processor minutes: {seconds / 60:.1f}")


if __name__ == "__main__":
    main()
