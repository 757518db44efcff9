"""Folders that look like checkpoints of LeRobot, without weights."""

import json

FRONT = "observation.images.front"
WRIST = "observation.images.wrist"
STATE = {"observation.state": {"type": "STATE", "shape": [8]}}


def pictures(**shapes):
    """Return what a configuration says of pictures; each shape is that of a camera."""
    return {
        f"observation.images.{name}": {"type": "VISUAL", "shape": shape}
        for name, shape in shapes.items()
    }


def write_checkpoint(folder, features=None, **config):
    """Make a folder a checkpoint that takes these inputs; return it."""
    folder.mkdir(parents=True, exist_ok=True)
    content = {"type": "act", "input_features": STATE | (features or {}), **config}
    (folder / "config.json").write_text(json.dumps(content))
    return folder
