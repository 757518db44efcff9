"""Golden runs: how episodes end, with words and goals; motion on the same family of processors."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from net_printed import printed

from roboirg.records.store import iterate_records

PLANS: Mapping[str, dict[str, Any]] = {
    "oracle": {"policies": ["oracle"], "settings": "explicit", "episodes": [0, 1]},
    "listener": {
        "policies": ["listener"],
        "settings": ["all", "direct-rival", "grounded"],
        "episodes": [3],
    },
    "forgetful": {"policies": ["forgetful"], "settings": "all", "episodes": [4]},
    "random": {
        "policies": ["random"],
        "settings": "direct",
        "episodes": [5],
        "max_steps": 300,
        "policy_seeds": [0, 7],
    },
    "words": {
        "policies": ["listener", "forgetful"],
        "tasks": ["PickXtimes", "VideoUnmask", "StopCube", "PutInBox"],
        "settings": ["direct", "contextual"],
        "in_turns": ["direct"],
        "forms": ["implicit", "resolved"],
        "arms": ["told", "other-goal", "paraphrase-1"],
        "episodes": [6],
    },
    "own": {
        "policies": ["own=net_policies:Reacher"],
        "tasks": ["BinFill", "VideoRepick", "PickByCount"],
        "settings": ["explicit", "contextual"],
        "episodes": [7],
        "max_steps": 100,
        "observe_every": 4,
        "demonstration_frames": 6,
    },
    "planners": {
        "policies": [
            "planner:oracle",
            "planner:oracle?subgoals=simple",
            "planner:listener",
            "planner:net_policies:Pointer",
        ],
        "tasks": ["BinFill", "VideoPlaceOrder", "ButtonUnmaskSwap"],
        "settings": ["direct"],
        "episodes": [8],
        "max_steps": 600,
    },
}
"""The fields of each run's plan; tasks are all, the real robot's twins too, unless named."""
EVERY_TASK = ["all", "PutInBox", "PickByCount"]


def episodes(folder: Path) -> dict[str, str]:
    """Play the plans and return a line of JSON for each episode, in the order of their jobs."""
    (folder / "net_policies.py").write_bytes(
        Path(__file__).with_name("net_policies.py").read_bytes()
    )
    found = {}
    for name, fields in PLANS.items():
        plan = {"tasks": EVERY_TASK, "split": "val", **fields}
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(plan), encoding="utf-8")
        printed(folder, "run", "--plan", f"{name}.yaml", "--out", name)
        lines = [
            json.dumps(_kept(record), sort_keys=True) for record in iterate_records(folder / name)
        ]
        found[name] = "\n".join([*sorted(lines), ""])
    return found


def without_motion(text: str) -> str:
    """Return the episodes of a run without what the last bits of a processor may change."""
    lines = [{**json.loads(line), "motion": None} for line in text.splitlines()]
    return "\n".join(json.dumps(one, sort_keys=True) for one in lines)


def _kept(record: Any) -> dict[str, Any]:
    said = [(one.stage, one.text) for one in record.instruction]
    motion = [(one.step, one.kind, one.subject, one.place, one.holds) for one in record.events]
    return {
        "job": [
            *(record.policy, record.task, record.episode, record.setting, record.form, record.arm),
            *(record.options.delivery, list(record.options.stages), record.policy_seed),
        ],
        "outcome": [record.outcome, record.error, record.cause],
        "attribution": None if record.attribution is None else record.attribution.sentence,
        "goals": None
        if record.goals is None
        else [record.goals.stated, *record.goals.reached, "agrees", *record.goals.agrees],
        "words": _hash([said, record.command]),
        "goal": {name: str(value) for name, value in record.goal.items()},
        "reported": [record.policy_metadata, record.usage],
        "subgoals": [(one.text, one.verdict, one.ended) for one in record.subgoals],
        "motion": [
            *(record.steps, record.demonstration_steps, record.calls),
            *(_hash(motion), record.end_state),
        ],
    }


def _hash(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()[:12]
