"""The data card: what a dataset holds, and the lines that train from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from roboirg.apps.demonstrations.export_plan import ExportPlan
from roboirg.apps.demonstrations.picture_coding import LOSSY_QUALITY
from roboirg.apps.demonstrations.trajectory import TrajectoryFacts
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.licenses import OWN_LICENSE, PICTURE_LICENSE, TERMS
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


def card_text(plan: ExportPlan, facts: Sequence[TrajectoryFacts], root: Path) -> str:
    """Return the text of a dataset's README.md (its card), with the head that Hugging Face reads.

    Args:
        plan: what is exported.
        facts: on all trajectories, those that are left out, too.
        root: folder of the dataset.
    """
    card_license = OWN_LICENSE if plan.pictures == "none" else PICTURE_LICENSE
    # The head, between two lines of dashes, is YAML.
    lines = ["---", f"license: {card_license}", "task_categories: [robotics]"]
    lines.append('tags: [LeRobot, robotics, RoboIRGBench, "arxiv:2609.34384"]')
    if plan.file_format.has_frame_tables:
        # Without them, Hugging Face takes the tables of facts for frames.
        lines.append("configs: [{config_name: default, data_files: data/*/*.parquet}]")
    lines += ["---", "", "# Demonstrations of RoboIRGBench", "", _head_line(plan), ""]
    lines += _words_lines(plan, facts)
    lines += ["", "## Content", "", *_content_lines(plan)]
    lines += ["", "## Training", "", plan.file_format.training_text(plan, root.resolve())]
    return "\n".join(lines) + "\n"


def _head_line(plan: ExportPlan) -> str:
    """Return the card's first sentences: split, format, versions, and how long a frame is."""
    rate = f"{CONTROL_RATE} frames per second, one per control step."
    if plan.actions == "waypoint":
        rate = f"A frame per waypoint; time stamps count frames, {CONTROL_RATE} to the second."
    return (
        f"Split {plan.split}, format {plan.format}, written by roboirg {__version__} (environment "
        f"{ENVIRONMENT_VERSION}, language {plan.language_label}, wordings of the pool "
        f"{plan.pool!r}). {rate}"
    )


def _words_lines(plan: ExportPlan, facts: Sequence[TrajectoryFacts]) -> Iterator[str]:
    """Yield two sentences of the card: on the instructions, and on the trajectories by outcome.

    `facts` are those of all trajectories, exported or not.
    """
    yield (
        f"Settings: {', '.join(plan.settings)}; forms: {', '.join(plan.forms)}. Each trajectory "
        "comes once with the words of each of them that can express it; "
        "`meta/demonstrations.parquet` says which episode is which, and how long each is."
    )
    outcomes = Counter(recorded.status for recorded in facts)
    counts = [f"{count} {status}" for status, count in outcomes.items()]
    yield f"Trajectories by outcome: {', '.join(counts)}."


def _content_lines(plan: ExportPlan) -> Iterator[str]:
    """Yield the card's lines on what a frame holds: state, action, video, pictures, licenses."""
    yield "- State: seven joint angles (rad) and the first finger (m)."
    origin = "exactly what was executed"
    if plan.disturbed:
        origin = "what the **disturbed** expert should have done; `executed_action` is what it did"
    yield f"- Action: {_MEANINGS[plan.actions]}; {origin}."
    if plan.video:
        yield "- Frames of the video come before the policy's, with `is_video_demo`."
    else:
        yield "- Frames of the videos are left out."
    if plan.pictures == "none":
        yield "- There are no pictures."
        return
    yield f"- Cameras: {', '.join(plan.cameras)}; {plan.size} × {plan.size} pixels."
    yield f"- Pictures are stored {_STORED[plan.pictures]}."
    yield f"- {TERMS}"
