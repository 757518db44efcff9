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

_HEADER = struct.Struct("<4sII")
"""Header of a binary glTF file: magic, version, size."""
_CHUNK = struct.Struct("<I4s")
"""Header of one of its chunks: size, kind."""
_WORD = 4
"""Alignment of chunks, bytes."""
_MESH = "mesh"
"""Name of the array with the installed file without its textures."""
_TEXTURES_OF_METAL = ("baseColorTexture", "metallicRoughnessTexture")
"""Textures that glTF keeps among the metallic properties of a material."""


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
    """Return the installed file without its textures, and each texture decoded."""
    path = find_model_files() / TABLE_FILE
    mesh = strip_textures(path.read_bytes())
    arrays: Arrays = {_MESH: np.frombuffer(mesh, np.uint8)}
    material = sapien.render.RenderShapeTriangleMesh(str(path)).parts[0].material
    for texture in _TEXTURES:
        pixels: NDArray[Any] = getattr(material, texture.field).download()
        arrays[texture.field] = np.ascontiguousarray(pixels[..., texture.channels])
    return arrays


def _load_shape(content: bytes) -> sapien.render.RenderShapeTriangleMesh:
    """Return the shape in a binary glTF file, given its content; SAPIEN reads only files."""
    with tempfile.TemporaryDirectory(prefix="roboirg-") as folder:
        path = Path(folder) / "table.glb"
        path.write_bytes(content)
        shape = sapien.render.RenderShapeTriangleMesh(str(path))
        shape.parts  # noqa: B018 - makes SAPIEN read the file while it is there
        return shape


def strip_textures(content: bytes) -> bytes:
    """Return a binary glTF file without its textures.

    The file is a header, a JSON description, then a buffer of binary data; both have a chunk
    header. The description divides the buffer into numbered views, and each image or array (an
    "accessor") names its view.
    """
    size, _ = _CHUNK.unpack_from(content, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    gltf = json.loads(content[start : start + size])
    buffer = content[start + size + _CHUNK.size :]

    kept_buffer = _keep_arrays(gltf, buffer)
    for material in gltf["materials"]:
        material.pop("normalTexture", None)
        for field in _TEXTURES_OF_METAL:
            material["pbrMetallicRoughness"].pop(field, None)
    for field in ("images", "textures", "samplers"):
        del gltf[field]
    gltf["buffers"] = [{"byteLength": len(kept_buffer)}]
    return _write_glb(json.dumps(gltf).encode(), kept_buffer)


def _keep_arrays(gltf: dict[str, Any], buffer: bytes) -> bytes:
    """Return the buffer without its images, and renumber the views in the description, in place.

    Args:
        gltf: the description; its views and accessors change.
        buffer: the binary data that it describes.
    """
    image_views = {image["bufferView"] for image in gltf["images"]}
    kept_buffer = b""
    kept_views: list[dict[str, Any]] = []
    new_numbers = {}
    for number, view in enumerate(gltf["bufferViews"]):
        if number in image_views:
            continue
        new_numbers[number] = len(kept_views)
        kept_views.append({**view, "byteOffset": len(kept_buffer)})
        first = view["byteOffset"]
        kept_buffer += buffer[first : first + view["byteLength"]]
    for accessor in gltf["accessors"]:
        accessor["bufferView"] = new_numbers[accessor["bufferView"]]
    gltf["bufferViews"] = kept_views
    return kept_buffer


def _write_glb(gltf: bytes, data: bytes) -> bytes:
    """Assemble a binary glTF file from its JSON and its binary data, a multiple of `_WORD`."""
    gltf += b" " * (-len(gltf) % _WORD)  # up to the next word
    chunks = _CHUNK.pack(len(gltf), b"JSON") + gltf + _CHUNK.pack(len(data), b"BIN\0") + data
    return _HEADER.pack(b"glTF", 2, _HEADER.size + len(chunks)) + chunks
