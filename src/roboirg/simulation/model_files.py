"""Model files of the Panda and the table, which are ManiSkill's.

They are looked for in the folder that ``ROBOIRG_MODEL_FILES`` names, such as that of an installed
ManiSkill, by default where ``roboirg fetch-models`` puts them. A hash verifies them: other files
would change pictures and dynamics.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from roboirg.core.errors import MissingDependencyError
from roboirg.util.regular_file import file_hash
from roboirg.util.user_folders import user_folder

FOLDER_VARIABLE = "ROBOIRG_MODEL_FILES"
REMEDY = "run: roboirg fetch-models (in a checkout: make setup)"

_ROBOT = "assets/robots/panda"
_MESHES = f"{_ROBOT}/franka_description/meshes"
_LINKS = tuple(f"link{number}" for number in range(8))
ROBOT_FILE = f"{_ROBOT}/panda_v3.urdf"
"""The Panda with a wrist camera."""
CAMERA_FILE = f"{_ROBOT}/realsense2_description/meshes/d415.stl"
"""Mesh of the wrist camera, binary STL."""
TABLE_FILE = "utils/scene_builder/table/assets/table.glb"
GROUND_FILE = "utils/building/assets/grid_texture.png"
"""Grid texture of the floor."""
MODEL_FILES = (
    ROBOT_FILE,
    f"{_ROBOT}/panda_v3.srdf",
    CAMERA_FILE,
    *(f"{_MESHES}/visual/{name}.glb" for name in (*_LINKS, "hand", "finger")),
    *(f"{_MESHES}/collision/{name}.stl" for name in (*_LINKS, "hand")),
    TABLE_FILE,
    GROUND_FILE,
)
"""Their names in ManiSkill's package, which are kept."""
_SHA256 = "9f361fea8bcea5593b0632f053d5798e5412a7532de7987230f0a72b15cca236"
"""Of the names and contents of all model files; see `_digest`."""


@functools.cache
def find_model_files() -> Path:
    """Return the folder of the model files, located and verified once per process."""
    return look_for_model_files()


def look_for_model_files() -> Path:
    """Return the folder of the model files, located and verified without caching."""
    root = fetched_folder()
    problem = _problem_of(root)
    if problem is not None:
        raise MissingDependencyError(f"{problem}; {REMEDY}")
    return root


def fetched_folder() -> Path:
    """Return the folder of the model files, which may not exist."""
    return user_folder("data", FOLDER_VARIABLE, below="mani_skill-3.0.1")


def _problem_of(root: Path) -> str | None:
    """Return what is wrong with the model files in a folder; None if nothing is."""
    missing = [name for name in MODEL_FILES if not (root / name).is_file()]
    if len(missing) == len(MODEL_FILES):
        return f"The model files of the robot and the table are not in {root}"
    if missing:
        return f"The model file {missing[0]} is missing in {root}"
    digest = _digest(root)
    if digest != _SHA256:
        return (
            f"The model files in {root} (SHA-256 {digest[:12]}...) are not those of "
            f"ManiSkill 3.0.1 ({_SHA256[:12]}...)"
        )
    return None


def _digest(root: Path) -> str:
    """Return one hash for all model files in a folder."""
    digest = hashlib.sha256()
    for name in MODEL_FILES:
        digest.update(name.encode())
        digest.update(bytes.fromhex(file_hash(root / name)))
    return digest.hexdigest()
