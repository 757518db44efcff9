"""Patch SAPIEN's shader to skip unused passes.

The scenes have no environment map, so image-based light and the background pass contribute nothing
and are removed; nothing is transparent either. Bodies can be shaded by one normal per triangle,
that of its first vertex (`FIRST_CORNER`); triangles can then share vertices, and the driver
has fewer to compute. No text of SAPIEN is stored here: the installed shader is patched when it is
used.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import logging
import shutil
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import sapien
import sapien.render

from roboirg.core.errors import InvalidValueError
from roboirg.util.atomic_write import write_atomically
from roboirg.util.cache import cache_folder

STOCK_SHADER = "minimal"
STOCK_COLOR = "Color"
COLOR = "ColorRaw"
"""Names of the RGBA output; the stock shader completes its own in a second pass."""
_HASH_DIGITS = 16
"""Hexadecimal digits of the files' hash in the name of their folder."""
_COMMON = "common"
"""Folder of the files that SAPIEN's shaders include."""
_BACKGROUND = ("composite.vert", "composite0.frag")
"""The pass that draws the environment map in the background."""
_STOCK_SHA256 = "ea4f9d94a72ef2d55096e5348704842f287c45164626a0dfde9d022ad4f23b78"

SHADING = "shadeFlat"
"""A per-body value of SAPIEN's shader; 0: vertex normals, 1: screen-space normals."""
FIRST_CORNER = 2
"""The value that the patched shader adds: the normal of a triangle's first vertex."""


class _Patch(NamedTuple):
    """A change of a shader file: the text from `start` to just before `end` is replaced.

    Attributes:
        file: name of the file.
        start: beginning of what is replaced.
        end: what follows it, and stays.
        replacement: what takes its place.
    """

    file: str
    start: str
    end: str
    replacement: str = ""


_NEVER_NEEDED = (
    _Patch("gbuffer.frag", "layout(set = 3, binding = 7)", "vec4 world2camera"),
    _Patch("gbuffer.frag", "vec3 getBackgroundColor", "layout(location = 0) in vec4"),
    _Patch("gbuffer.frag", "  vec3 wnormal", "  color += sceneBuffer"),
    _Patch("gbuffer.frag", "  if (albedo.a == 0)", "  frm.r"),
)
"""Image-based light, the background, and what is transparent."""
_INTERFACE = (
    _Patch("gbuffer.vert", "layout(location = 2) out", "layout(location = 4) out"),
    _Patch("gbuffer.vert", "  outSegmentation =", "  mat4 modelView"),
    _Patch("gbuffer.vert", "  objectCoord =", "  outPosition ="),
    _Patch("gbuffer.frag", "layout(location = 2) in", "layout(location = 4) in"),
    _Patch("gbuffer.frag", "inSegmentation[1]", ")", "int(objectDataBuffer.segmentation[1])"),
)
"""Values that the vertex shader hands on for each vertex, though they are the same for a body."""
_SHADING = (
    _Patch(
        "gbuffer.vert",
        "void main",
        "{",
        "layout(location = 2) out flat vec3 outFlat;\n\nvoid main() ",
    ),
    _Patch("gbuffer.vert", "  mat3 normalMatrix", "  outPosition"),
    _Patch(
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
    _Patch(
        "gbuffer.frag",
        "layout(location = 0) out",
        " vec4",
        "layout(location = 2) in flat vec3 inFlat;\n\nlayout(location = 0) out",
    ),
    _Patch(
        "gbuffer.frag",
        f"  if (objectDataBuffer.{SHADING} == 0)",
        " {",
        f"""\
  if (objectDataBuffer.{SHADING} == {FIRST_CORNER}) {{
    normal = normalize(inFlat);
  }} else if (objectDataBuffer.{SHADING} == 0)""",
    ),
)
"""The shading by one normal per triangle."""

_log = logging.getLogger(__name__)


@functools.cache
def slim_shader() -> str:
    """Return the folder of the patched shader, as SAPIEN takes it.

    Raises:
        InvalidValueError: the installed shader is not the one that the patches are for.
    """
    texts = _read_installed_shader()
    if _digest(texts) != _STOCK_SHA256:
        raise InvalidValueError(
            f"The shader in {str(_shader_folder())!r} is not SAPIEN 3.0.3's, which pictures depend "
            "on; install sapien==3.0.3 again."
        )
    for patch in (*_NEVER_NEEDED, *_INTERFACE, *_SHADING):
        name = f"{STOCK_SHADER}/{patch.file}"
        texts[name] = _apply(patch, texts[name])
    for file in _BACKGROUND:
        del texts[f"{STOCK_SHADER}/{file}"]
    return str(_write(texts) / STOCK_SHADER)


@functools.cache
def placeholder_brdf_table() -> sapien.render.RenderTexture:
    """Return a tiny texture to replace the BRDF table, which cameras' shaders never need.

    The shader samples the table only for an environment map, which is black here; otherwise SAPIEN
    computes it for three seconds before the first picture. The texture is cached for the life of
    the process, because cameras do not keep their textures alive.
    """
    return sapien.render.RenderTexture(np.zeros((2, 2, 4), np.uint8), 2, "r8g8b8a8unorm")


def _read_installed_shader() -> dict[str, str]:
    """Return the files of SAPIEN's shader and its includes, by folder and name."""
    common = _shader_folder() / _COMMON
    stock = _shader_folder() / STOCK_SHADER
    paths = sorted([*common.iterdir(), *stock.iterdir()])
    return {f"{path.parent.name}/{path.name}": path.read_text() for path in paths}


def _shader_folder() -> Path:
    """Return the folder of the shaders that come with SAPIEN."""
    return Path(sapien.__file__).parent / "vulkan_shader"


def _digest(texts: dict[str, str]) -> str:
    """Return one hash of all names and texts, which depends on their order."""
    digest = hashlib.sha256()
    for name, text in texts.items():
        digest.update(f"{name} {len(text)} {text}".encode())
    return digest.hexdigest()


def _apply(patch: _Patch, text: str) -> str:
    """Return a file's text with a patch applied: "a START b END c" → "a REPLACEMENT END c"."""
    first = text.index(patch.start)
    last = text.index(patch.end, first + len(patch.start))
    return text[:first] + patch.replacement + text[last:]


def _write(texts: dict[str, str]) -> Path:
    """Write the files to a folder of the cache and return it.

    Where there is no cache, they are written to a folder that lives as long as the process.
    """
    folder = cache_folder()
    if folder is not None:
        version = _digest(texts)[:_HASH_DIGITS]
        try:
            return _fill(folder / "shaders" / version, texts)
        except (OSError, InvalidValueError) as error:
            _log.warning("The cache cannot be used for shaders (%s).", error)
    temporary = Path(tempfile.mkdtemp(prefix="roboirg-shaders-"))
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    return _fill(temporary, texts)


def _fill(folder: Path, texts: dict[str, str]) -> Path:
    """Write the files that a folder lacks, or has with another content; return the folder."""
    for name, text in texts.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_bytes() != text.encode():
            write_atomically(path, text.encode())
    return folder
