"""The table's mesh, with its textures as they are drawn.

Decoding them takes a tenth of a second, so what they decode to is kept with other derived meshes,
and so is the installed file without its pictures: SAPIEN reads the mesh from that, because only
for meshes from files does it compute the tangents that the table's normal map needs.
"""

from __future__ import annotations

import functools
import json
import struct
import tempfile
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import sapien
import sapien.render
from numpy.typing import NDArray

from roboirg.simulation.model_files import find_model_files
from roboirg.simulation.rendering.mesh_cache import Arrays, cached_arrays, source_code

METALLIC = 1.0
"""What the table's texture of that says everywhere."""

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
"""Of a binary glTF file: magic, version, size; of its JSON and of its data: size, kind."""
_WORD = 4
_MESH = "mesh"


class _Texture(NamedTuple):
    """How a texture of the material is made of an array.

    Attributes:
        field: of the material.
        channels: of the installed texture, which are kept.
        format: of such arrays.
        srgb: whether colors are stored as screens want them.
    """

    field: Literal["base_color_texture", "normal_texture", "roughness_texture"]
    channels: slice
    format: str
    srgb: bool


_TEXTURES = (
    _Texture("base_color_texture", slice(0, 4), "r8g8b8a8unorm", srgb=True),
    _Texture("normal_texture", slice(0, 4), "r8g8b8a8unorm", srgb=False),
    _Texture("roughness_texture", slice(1, 2), "r8unorm", srgb=False),
)


@functools.cache
def table_shape() -> sapien.render.RenderShapeTriangleMesh:
    """The table's shape, unscaled, to be cloned; a number replaces the texture of its metal."""
    arrays = cached_arrays("table", source_code("table_mesh"), _derive)
    shape = _loaded(arrays[_MESH].tobytes())
    material = shape.parts[0].material
    for texture in _TEXTURES:
        made = sapien.render.RenderTexture2D(
            np.asarray(arrays[texture.field]), texture.format, srgb=texture.srgb
        )
        setattr(material, texture.field, made)
    material.metallic = METALLIC
    return shape


def _derive() -> Arrays:
    path = find_model_files().table
    material = sapien.render.RenderShapeTriangleMesh(str(path)).parts[0].material
    arrays: Arrays = {_MESH: np.frombuffer(without_pictures(path.read_bytes()), np.uint8)}
    for texture in _TEXTURES:
        pixels: NDArray[Any] = getattr(material, texture.field).download()
        arrays[texture.field] = np.ascontiguousarray(pixels[..., texture.channels])
    return arrays


def _loaded(content: bytes) -> sapien.render.RenderShapeTriangleMesh:
    """A shape of a file with such a content."""
    with tempfile.TemporaryDirectory(prefix="roboirg-") as folder:
        path = Path(folder) / "table.glb"
        path.write_bytes(content)
        shape = sapien.render.RenderShapeTriangleMesh(str(path))
        # SAPIEN reads the file when its parts are looked at.
        assert shape.parts  # noqa: S101
        return shape


def without_pictures(content: bytes) -> bytes:
    """A binary glTF file without its textures."""
    size, _ = _CHUNK.unpack_from(content, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    told = json.loads(content[start : start + size])
    data = content[start + size + _CHUNK.size :]
    pictures = {image["bufferView"] for image in told["images"]}
    kept = [number for number in range(len(told["bufferViews"])) if number not in pictures]
    views, place = [], 0
    parts = []
    for number in kept:
        view = told["bufferViews"][number]
        first, length = view["byteOffset"], view["byteLength"]
        parts.append(data[first : first + length])
        views.append({**view, "byteOffset": place})
        place += length
    for accessor in told["accessors"]:
        accessor["bufferView"] = kept.index(accessor["bufferView"])
    for material in told["materials"]:
        material.pop("normalTexture", None)
        for field in ("baseColorTexture", "metallicRoughnessTexture"):
            material["pbrMetallicRoughness"].pop(field, None)
    for field in ("images", "textures", "samplers"):
        del told[field]
    told["bufferViews"], told["buffers"] = views, [{"byteLength": place}]
    return _glb(json.dumps(told).encode(), b"".join(parts))


def _glb(told: bytes, data: bytes) -> bytes:
    """A binary glTF file of its JSON and its data, which fills whole words."""
    told += b" " * (-len(told) % _WORD)
    chunks = b"".join(
        _CHUNK.pack(len(chunk), kind) + chunk for kind, chunk in ((b"JSON", told), (b"BIN\0", data))
    )
    return _HEADER.pack(b"glTF", 2, _HEADER.size + len(chunks)) + chunks
