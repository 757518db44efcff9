"""Derived meshes: exact, cached, and unaffected by damage to the cache."""

import subprocess
import sys

import numpy as np
import pytest
import sapien.render
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes

from roboirg.simulation.model_files import TABLE_FILE, find_model_files
from roboirg.simulation.rendering import mesh_cache, robot_meshes, table_mesh
from roboirg.simulation.rendering.mesh_cache import cached_arrays, pack_arrays, unpack_arrays
from roboirg.util.cache import open_cache

DERIVED_MESHES = 13
"""Ten links of the robot, what the front camera sees of one, the wrist camera and the table."""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path))
    return tmp_path / "meshes"


def entries(cache):
    return sorted(path.name for path in cache.glob("[!.]*"))


names = st.text("abc_0123", min_size=1)


@settings(max_examples=12)
@given(st.dictionaries(names, arrays(scalar_dtypes(), array_shapes(min_dims=0, min_side=0))))
def test_packed_arrays_are_unpacked_bit_for_bit(given_arrays):
    again = unpack_arrays(memoryview(pack_arrays(given_arrays)))
    assert list(again) == list(given_arrays)
    for name, array in given_arrays.items():
        assert (again[name].dtype, again[name].shape) == (array.dtype, array.shape)
        assert again[name].tobytes() == array.tobytes()


def test_cached_arrays_are_computed_once_for_each_source(cache):
    made = []

    def make():
        made.append(None)
        return {"corners": np.arange(6.0).reshape(2, 3)}

    for sources in (b"first", b"first", b"second"):
        ((name, array),) = cached_arrays("thing", sources, make).items()
        assert (name, array.tolist()) == ("corners", [[0, 1, 2], [3, 4, 5]])
    assert len(made) == len(entries(cache)) == 2


def test_cached_meshes_stay_within_their_sixteenth_of_the_cache(cache, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE_GIB", str(16 * 10_000 / 2**30))
    for number in range(20):
        cached_arrays("thing", bytes([number]), lambda: {"zeros": np.zeros(200)})
        assert sum(path.stat().st_size for path in cache.iterdir()) <= 10_000
    assert 1 < len(entries(cache)) < 20

    open_cache("actions").write("a1", bytes(5000))
    assert open_cache("actions").read("a1") == bytes(5000)


PRINT_CHECKSUM_OF_PICTURE = """
import zlib, roboirg
print(zlib.crc32(roboirg.make("PickXtimes").reset()[0]["front_rgb"].tobytes()))
"""


@pytest.mark.slow
@pytest.mark.sim
def test_damaged_cached_meshes_are_rebuilt_with_a_warning(cache):
    """One file is cut off, in another one bit is flipped; the picture must not change."""

    def draw():
        done = subprocess.run(
            [sys.executable, "-c", PRINT_CHECKSUM_OF_PICTURE],
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout, done.stderr

    picture, complaints = draw()
    assert complaints == ""

    sound = {path.name: path.read_bytes() for path in cache.iterdir()}
    assert len(sound) == len(entries(cache)) == DERIVED_MESHES

    harmed = [next(cache.glob(f"{name}-*")) for name in ("table", "link0")]
    harmed[0].write_bytes(sound[harmed[0].name][:-1000])
    raw = bytearray(sound[harmed[1].name])
    raw[len(raw) // 2] ^= 1
    harmed[1].write_bytes(raw)
    again, complaints = draw()

    assert again == picture
    for path in harmed:
        assert f"The cache entry {path} is damaged and will be rebuilt." in complaints
    assert complaints.count("rebuilt") == 2
    assert {path.name: path.read_bytes() for path in cache.iterdir()} == sound


@pytest.mark.sim
def test_our_reduced_table_mesh_equals_the_installed_model():
    stock = sapien.render.RenderShapeTriangleMesh(str(find_model_files() / TABLE_FILE))
    for ours, theirs in zip(table_mesh.table_shape().parts, stock.parts, strict=True):
        for what in ("vertices", "triangles"):
            assert np.array_equal(getattr(ours, what), getattr(theirs, what))
        assert np.array_equal(ours.get_vertex_normal(), theirs.get_vertex_normal())
        assert np.array_equal(ours.get_vertex_uv(), theirs.get_vertex_uv())

    theirs = stock.parts[0].material
    assert (theirs.metallic_texture.download()[..., 2] == 255 * table_mesh.METALLIC).all()
    assert theirs.emission_texture is theirs.transmission_texture is None
    for texture in table_mesh._TEXTURES:
        held = getattr(theirs, texture.field)
        assert (held.is_srgb, held.mipmap_levels) == (texture.srgb, 1)
        assert held.address_mode == "repeat"


def test_the_cache_key_of_a_mesh_changes_with_the_code_that_computes_it(cache, monkeypatch):
    cached_arrays("thing", b"", dict)
    monkeypatch.setattr(mesh_cache, "source_code", lambda *_: b"other code")

    cached_arrays("thing", b"", dict)

    assert len(entries(cache)) == 2
    assert robot_meshes.source_code("robot_meshes") != mesh_cache.source_code("robot_meshes")
