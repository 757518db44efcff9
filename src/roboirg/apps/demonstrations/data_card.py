"""The data card: what a dataset holds, and the lines that train from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from roboirg.apps.demonstrations.dataset_part import DatasetPart
from roboirg.apps.demonstrations.export_plan import ExportPlan
from roboirg.apps.demonstrations.formats.training_lines import training_text
from roboirg.apps.demonstrations.picture_coding import LOSSY_QUALITY
from roboirg.apps.demonstrations.trajectory import TrajectoryFacts, load_facts
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.version import __version__
from roboirg.util.media import CONTROL_RATE

_STORED = {
    "png": "without loss, as PNG",
    "lossless-video": "without loss, as H.264 in RGB",
    "lossy-video": f"with loss: H.264, yuv420p, constant rate factor {LOSSY_QUALITY}",
}
_MEANINGS = {
    "joint_angle": "absolute joint targets (rad) and the gripper, +1 open to -1 closed",
    "waypoint": "the tool's x, y, z (m), roll, pitch, yaw (rad, extrinsic x-y-z, unwrapped) in the "
    "world frame, and what the gripper does there, +1 open, -1 close, 0 neither",
}


def card_text(
    plan: ExportPlan, parts: Sequence[DatasetPart], facts: Sequence[TrajectoryFacts], root: Path
) -> str:
    """Return the card of a dataset as Markdown, with the head that Hugging Face reads.

    Args:
        plan: what is exported.
        parts: of the dataset.
        facts: of all trajectories, those that are left out, too.
        root: folder of the dataset.
    """
    lengths = list(_lengths(parts))
    lines = [
        "---",
        "license: apache-2.0",
        "task_categories: [robotics]",
        "tags: [LeRobot, RoboIRGBench]",
        # Without them, Hugging Face takes the tables of facts for frames.
        *(
            ()
            if plan.format == "robomme-hdf5"
            else ("configs: [{config_name: default, data_files: data/*/*.parquet}]",)
        ),
        "---",
        "",
        "# Demonstrations of RoboIRGBench",
        "",
        _head_line(plan),
        "",
        *_count_lines(plan, lengths, facts),
        "",
        "## Content",
        "",
        *_content_lines(plan),
        "",
        "## Training",
        "",
        training_text(plan, root),
    ]
    return "\n".join(lines) + "\n"


def _head_line(plan: ExportPlan) -> str:
    rate = f"{CONTROL_RATE} frames per second, one per control step."
    if plan.actions == "waypoint":
        rate = f"A frame per waypoint; time stamps count frames, {CONTROL_RATE} to the second."
    return (
        f"Split {plan.split}, format {plan.format}, written by roboirg {__version__} (environment "
        f"{ENVIRONMENT_VERSION}, language {plan.language_label}, wordings of the pool "
        f"{plan.pool!r}). {rate}"
    )


def _lengths(parts: Sequence[DatasetPart]) -> Iterator[tuple[int, str, int]]:
    """Yield frames, task and number of instructions of each trajectory."""
    for part in parts:
        for episode in part.episodes:
            facts = load_facts(episode.path)
            yield facts.frames, facts.task, len(episode.texts)


def _count_lines(
    plan: ExportPlan,
    lengths: Sequence[tuple[int, str, int]],
    facts: Sequence[TrajectoryFacts],
) -> Iterator[str]:
    yield "| task | trajectories | their frames | episodes | frames |"
    yield "| --- | --- | --- | --- | --- |"
    tasks = dict.fromkeys(task for _, task, _ in lengths)
    for label, names in (*((task, {task}) for task in tasks), ("all", tasks)):
        own = [(length, count) for length, name, count in lengths if name in names]
        shortest, longest = min(own)[0], max(own)[0]
        episodes, frames = sum(count for _, count in own), sum(a * b for a, b in own)
        yield f"| {label} | {len(own)} | {shortest} to {longest} | {episodes} | {frames} |"
    yield ""
    words = ", ".join(plan.settings)
    yield (
        f"Settings: {words}; forms: {', '.join(plan.forms)}. Each trajectory comes once with the "
        "words of each of them that can express it; `meta/demonstrations.parquet` says which "
        "episode is which."
    )
    ends = Counter(one.status for one in facts)
    yield f"Trajectories by outcome: {', '.join(f'{n} {status}' for status, n in ends.items())}."


def _content_lines(plan: ExportPlan) -> Iterator[str]:
    yield "State: seven joint angles (rad) and the first finger (m)."
    origin = "exactly what was executed"
    if plan.disturbed:
        origin = "what the **disturbed** expert should have done; `executed_action` is what it did"
    yield f"Action: {_MEANINGS[plan.actions]}; {origin}."
    if plan.video:
        yield "Frames of the video come before the policy's, with `is_video_demo`."
    else:
        yield "Frames of the videos are left out."
    if plan.pictures == "none":
        yield "There are no pictures."
        return
    yield f"Cameras: {', '.join(plan.cameras)}; {plan.size} × {plan.size} pixels."
    yield f"Pictures are stored {_STORED[plan.pictures]}."
