"""SAPIEN's shader without what adds nothing to our pictures, derived from the installed one.

Our scenes have no environment map, so all light from it is exactly zero and is left out, and with
it the pass that draws it behind everything; nothing is transparent either. Bodies
can be marked (`mark`) as shaded by one normal for each triangle, that of its first corner; their
corners can then be shared between triangles, and the graphics driver has fewer of them to compute.
Nothing of SAPIEN's text is kept here: the installed text is edited when it is used, and if it is
not the one for which the edits were written, it is used as it is.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import logging
import shutil
import tempfile
from pathlib import Path

import numpy as np
import sapien
import sapien.render

from roboirg.simulation.rendering.mesh_cache import write_whole
from roboirg.util.cache import cache_folder

STOCK_SHADER = "minimal"
STOCK_COLOR, COLOR = "Color", "ColorRaw"
"""The pictures that hold RGBA: the stock shader completes its own in a second pass."""
_COMMON = "common"
_BACKGROUND = ("composite.vert", "composite0.frag")
"""The pass that puts the environment behind everything."""
_STOCK_SHA256 = "ea4f9d94a72ef2d55096e5348704842f287c45164626a0dfde9d022ad4f23b78"

SHADING, FIRST_CORNER = "shadeFlat", 2
"""A number that SAPIEN's shader has for each body (0: normals at the corners, 1: normals by the
screen), and a value that the derived shader knows besides."""

_NEVER_NEEDED = (
    # file, from, up to, what comes instead
    ("gbuffer.frag", "layout(set = 3, binding = 7)", "vec4 world2camera", ""),
    ("gbuffer.frag", "vec3 getBackgroundColor", "layout(location = 0) in vec4", ""),
    ("gbuffer.frag", "  vec3 wnormal", "  color += sceneBuffer", ""),
    ("gbuffer.frag", "  if (albedo.a == 0)", "  frm.r", ""),
)
_INTERFACE = (
    ("gbuffer.vert", "layout(location = 2) out", "layout(location = 4) out", ""),
    ("gbuffer.vert", "  outSegmentation =", "  mat4 modelView", ""),
    ("gbuffer.vert", "  objectCoord =", "  outPosition =", ""),
    ("gbuffer.frag", "layout(location = 2) in", "layout(location = 4) in", ""),
    ("gbuffer.frag", "inSegmentation[1]", ")", "int(objectDataBuffer.segmentation[1])"),
)
_SHADING = (
    (
        "gbuffer.vert",
        "void main",
        "{",
        "layout(location = 2) out flat vec3 outFlat;\n\nvoid main() ",
    ),
    ("gbuffer.vert", "  mat3 normalMatrix", "  outPosition", ""),
    (
        "gbuffer.vert",
        "  vec3 outTangent",
        " = ",
        f"""\
  outFlat = vec3(0);
  outTbn = mat3(0);
  if (objectDataBuffer.{SHADING} == {FIRST_CORNER}) {{
    outFlat = normalize(transpose(inverse(mat3(modelView))) * normal);
    return;
  }}
  mat3 normalMatrix = mat3(transpose(inverse(modelView)));
  vec3 outTangent""",
    ),
    (
        "gbuffer.frag",
        "layout(location = 0) out",
        " vec4",
        "layout(location = 2) in flat vec3 inFlat;\n\nlayout(location = 0) out",
    ),
    (
        "gbuffer.frag",
        f"  if (objectDataBuffer.{SHADING} == 0)",
        " {",
        f"""\
  if (objectDataBuffer.{SHADING} == {FIRST_CORNER}) {{
    normal = normalize(inFlat);
  }} else if (objectDataBuffer.{SHADING} == 0)""",
    ),
)

_log = logging.getLogger(__name__)


@functools.cache
def slim_shader() -> str | None:
    """The folder of the derived shader; None if SAPIEN's is not the one that is known."""
    texts = _installed()
    digest = _digest(texts)
    if digest != _STOCK_SHA256:
        _log.warning("SAPIEN's shader is not the one that is known; it is used as it is.")
        return None
    for name, start, end, instead in (*_NEVER_NEEDED, *_INTERFACE, *_SHADING):
        key = f"{STOCK_SHADER}/{name}"
        texts[key] = _edit(texts[key], start, end, instead)
    for name in _BACKGROUND:
        del texts[f"{STOCK_SHADER}/{name}"]
    return str(_write(texts) / STOCK_SHADER)


def mark(body: sapien.render.RenderBodyComponent) -> None:
    """Have the derived shader give each of a body's triangles the normal of its first corner."""
    body.set_property(SHADING, FIRST_CORNER)


@functools.cache
def stand_in_table() -> sapien.render.RenderTexture:
    """A tiny texture in the place of a table that the cameras' shaders never need.

    The shader samples the table only for an environment map, which is black here; without a
    stand-in SAPIEN computes it for three seconds before the first picture. It is kept for the
    life of the process, because cameras do not keep their textures alive.
    """
    return sapien.render.RenderTexture(np.zeros((2, 2, 4), np.uint8), 2, "r8g8b8a8unorm")


def _installed() -> dict[str, str]:
    """The texts of SAPIEN's shader and of what it includes, by folder and name."""
    root = Path(sapien.__file__).parent / "vulkan_shader"
    paths = sorted(path for part in (_COMMON, STOCK_SHADER) for path in (root / part).iterdir())
    return {f"{path.parent.name}/{path.name}": path.read_text() for path in paths}


def _digest(texts: dict[str, str]) -> str:
    digest = hashlib.sha256()
    for name, text in texts.items():
        digest.update(f"{name} {len(text)} {text}".encode())
    return digest.hexdigest()


def _edit(text: str, start: str, end: str, instead: str) -> str:
    """The text with what begins with `start` and ends before the next `end` replaced."""
    first = text.index(start)
    return text[:first] + instead + text[text.index(end, first + len(start)) :]


def _write(texts: dict[str, str]) -> Path:
    """Put the texts into a folder; what is there already is checked."""
    folder = cache_folder()
    if folder is not None:
        try:
            return _fill(folder / "shaders" / _digest(texts)[:16], texts)
        except OSError as error:
            _log.warning("The cache cannot be used for shaders (%s).", error)
    passing = Path(tempfile.mkdtemp(prefix="roboirg-shaders-"))
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return _fill(passing, texts)


def _fill(folder: Path, texts: dict[str, str]) -> Path:
    for name, text in texts.items():
        path = folder / name
        if not path.is_file() or path.read_bytes() != text.encode():
            write_whole(path, text.encode())
    return folder
