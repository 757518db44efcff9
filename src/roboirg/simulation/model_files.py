"""Model files of the Panda and the table, read from the installed ManiSkill.

ManiSkill is located without importing it, and a hash verifies the files: other files would change
pictures and dynamics.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path

from roboirg.core.errors import MissingDependencyError

REMEDY = "install them with: pip install --no-deps mani_skill==3.0.1"

_ROBOT = "assets/robots/panda"
_MESHES = f"{_ROBOT}/franka_description/meshes"
_LINKS = tuple(f"link{number}" for number in range(8))
_FILES = (
    f"{_ROBOT}/panda_v3.urdf",
    f"{_ROBOT}/panda_v3.srdf",
    f"{_ROBOT}/realsense2_description/meshes/d415.stl",
    *(f"{_MESHES}/visual/{name}.glb" for name in (*_LINKS, "hand", "finger")),
    *(f"{_MESHES}/collision/{name}.stl" for name in (*_LINKS, "hand")),
    "utils/scene_builder/table/assets/table.glb",
    "utils/building/assets/grid_texture.png",
)
_SHA256 = "9f361fea8bcea5593b0632f053d5798e5412a7532de7987230f0a72b15cca236"


@dataclass(frozen=True, slots=True)
class ModelFiles:
    """Paths of the model files.

    Attributes:
        robot: URDF of the Panda with a wrist camera.
        wrist_camera: mesh of the wrist camera, binary STL.
        table: mesh of the table.
        ground_texture: grid texture of the floor.
    """

    robot: Path
    wrist_camera: Path
    table: Path
    ground_texture: Path


@functools.cache
def find_model_files() -> ModelFiles:
    """Return the model files of ManiSkill 3.0.1, located and verified once per process.

    Raises:
        MissingDependencyError: ManiSkill is not installed, or its files are not those of 3.0.1.
    """
    return look_for_model_files()


def look_for_model_files() -> ModelFiles:
    """Locate and verify the model files without caching.

    Raises:
        MissingDependencyError: ManiSkill is not installed, or its files are not those of 3.0.1.
    """
    root = _package_folder()
    missing = [name for name in _FILES if not (root / name).is_file()]
    if missing:
        raise MissingDependencyError(f"ManiSkill's model file {missing[0]} is missing; {REMEDY}")
    digest = _digest(root)
    if digest != _SHA256:
        raise MissingDependencyError(
            f"ManiSkill's model files (SHA-256 {digest[:12]}...) are not those of version 3.0.1 "
            f"({_SHA256[:12]}...); {REMEDY}"
        )
    return ModelFiles(
        robot=root / _FILES[0],
        wrist_camera=root / _FILES[2],
        table=root / _FILES[-2],
        ground_texture=root / _FILES[-1],
    )


def _package_folder() -> Path:
    spec = importlib.util.find_spec("mani_skill")
    if spec is None or not spec.submodule_search_locations:
        raise MissingDependencyError(f"ManiSkill's model files are not installed; {REMEDY}")
    return Path(spec.submodule_search_locations[0])


def _digest(root: Path) -> str:
    digest = hashlib.sha256()
    for name in _FILES:
        digest.update(name.encode())
        with (root / name).open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()
