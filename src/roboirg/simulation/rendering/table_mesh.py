"""The table's mesh, with decoded textures.

Decoding takes a tenth of a second, so the decoded textures are cached with other derived meshes, as
is the installed file without its textures. SAPIEN reads the mesh from this file, because it
computes the tangents for the normal map only for meshes from files.
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

from roboirg.simulation.model_files import TABLE_FILE, find_model_files
from roboirg.simulation.rendering.mesh_cache import Arrays, cached_arrays, source_code

METALLIC = 1.0
"""The constant value of the table's metallic texture."""

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
"""Headers of a binary glTF file (magic, version, size) and of its chunks (size, kind)."""
_WORD = 4
_MESH = "mesh"


class _Texture(NamedTuple):
    """A texture of the material and the array it is made from.

    Attributes:
        field: field of the material.
        channels: channels of the installed texture to keep.
        format: pixel format of the array.
        srgb: whether colors are sRGB-encoded.
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
    """Return the table's unscaled shape, to be cloned; a constant replaces the metallic texture."""
    arrays = cached_arrays("table", source_code("table_mesh"), _make_table_arrays)
    shape = _load_shape(arrays[_MESH].tobytes())
    material = shape.parts[0].material
    for texture in _TEXTURES:
        decoded = sapien.render.RenderTexture2D(
            np.asarray(arrays[texture.field]), texture.format, srgb=texture.srgb
        )
        setattr(material, texture.field, decoded)
    material.metallic = METALLIC
    return shape


def _make_table_arrays() -> Arrays:
    path = find_model_files() / TABLE_FILE
    material = sapien.render.RenderShapeTriangleMesh(str(path)).parts[0].material
    arrays: Arrays = {_MESH: np.frombuffer(strip_textures(path.read_bytes()), np.uint8)}
    for texture in _TEXTURES:
        pixels: NDArray[Any] = getattr(material, texture.field).download()
        arrays[texture.field] = np.ascontiguousarray(pixels[..., texture.channels])
    return arrays


def _load_shape(content: bytes) -> sapien.render.RenderShapeTriangleMesh:
    with tempfile.TemporaryDirectory(prefix="roboirg-") as folder:
        path = Path(folder) / "table.glb"
        path.write_bytes(content)
        shape = sapien.render.RenderShapeTriangleMesh(str(path))
        shape.parts  # noqa: B018 - makes SAPIEN read the file while it is there
        return shape


def strip_textures(content: bytes) -> bytes:
    """Return a binary glTF file without its textures."""
    size, _ = _CHUNK.unpack_from(content, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    gltf = json.loads(content[start : start + size])
    data = content[start + size + _CHUNK.size :]
    images = {image["bufferView"] for image in gltf["images"]}
    buffer_views = [number for number in range(len(gltf["bufferViews"])) if number not in images]
    views, offset = [], 0
    parts = []
    for number in buffer_views:
        view = gltf["bufferViews"][number]
        first, length = view["byteOffset"], view["byteLength"]
        parts.append(data[first : first + length])
        views.append({**view, "byteOffset": offset})
        offset += length
    for accessor in gltf["accessors"]:
        accessor["bufferView"] = buffer_views.index(accessor["bufferView"])
    for material in gltf["materials"]:
        material.pop("normalTexture", None)
        for field in ("baseColorTexture", "metallicRoughnessTexture"):
            material["pbrMetallicRoughness"].pop(field, None)
    for field in ("images", "textures", "samplers"):
        del gltf[field]
    gltf["bufferViews"], gltf["buffers"] = views, [{"byteLength": offset}]
    return _write_glb(json.dumps(gltf).encode(), b"".join(parts))


def _write_glb(gltf: bytes, data: bytes) -> bytes:
    """Assemble a binary glTF file from its JSON and its word-aligned data."""
    gltf += b" " * (-len(gltf) % _WORD)
    chunks = b"".join(
        _CHUNK.pack(len(chunk), kind) + chunk for kind, chunk in ((b"JSON", gltf), (b"BIN\0", data))
    )
    return _HEADER.pack(b"glTF", 2, _HEADER.size + len(chunks)) + chunks
