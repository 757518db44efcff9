"""Derived meshes: exact, cached, and unaffected by damage to the cache."""

import os
import shutil
import subprocess
import sys
import time

import numpy as np
import pytest
import sapien.render
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes

from roboirg.simulation.model_files import find_model_files
from roboirg.simulation.rendering import mesh_cache, robot_meshes, table_mesh
from roboirg.simulation.rendering.mesh_cache import cached_arrays, pack_arrays, unpack_arrays
from roboirg.util.cache import open_cache

DERIVED = 13
"""Ten links of the robot, what the front camera sees of one, the wrist camera and the table."""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path))
    return tmp_path / "meshes"


def complete(cache):
    return sorted(path.name for path in cache.glob("[!.]*"))


@given(st.dictionaries(st.text(), arrays(scalar_dtypes(), array_shapes(min_dims=0, min_side=0))))
def test_arrays_come_back_as_they_were(given_arrays):
    again = unpack_arrays(memoryview(pack_arrays(given_arrays)))
    assert list(again) == list(given_arrays)
    for name, array in given_arrays.items():
        assert (again[name].dtype, again[name].shape) == (array.dtype, array.shape)
        assert again[name].tobytes() == array.tobytes()


def test_what_was_derived_is_not_derived_again(cache):
    made = []

    def make():
        made.append(None)
        return {"corners": np.arange(6.0).reshape(2, 3)}

    for sources in (b"first", b"first", b"second"):
        ((name, array),) = cached_arrays("thing", sources, make).items()
        assert (name, array.tolist()) == ("corners", [[0, 1, 2], [3, 4, 5]])
    assert len(made) == len(complete(cache)) == 2


def test_meshes_have_a_share_of_the_cache(cache, monkeypatch):
    monkeypatch.setenv("ROBOIRG_CACHE_GIB", str(16 * 10_000 / 2**30))
    for number in range(20):
        cached_arrays("thing", bytes([number]), lambda: {"zeros": np.zeros(200)})
        assert sum(path.stat().st_size for path in cache.iterdir()) <= 10_000
    assert 1 < len(complete(cache)) < 20
    open_cache("actions").write("a1", bytes(5000))
    assert open_cache("actions").read("a1") == bytes(5000)


FILL = """
import sys, zlib
import roboirg
print("ready", flush=True)
sys.stdin.readline()
picture = roboirg.make("PickXtimes").reset()[0]["front_rgb"]
print(zlib.crc32(picture.tobytes()), flush=True)
"""


def filler(cache):
    process = subprocess.Popen(
        [sys.executable, "-c", FILL],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROBOIRG_CACHE": str(cache.parent)},
    )
    assert process.stdout.readline() == "ready\n"
    return process


def begin(process):
    process.stdin.write("\n")
    process.stdin.flush()


def told_by(process):
    out, complaints = process.communicate(timeout=600)
    assert process.returncode == 0, complaints
    return out, complaints


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """A filled cache and the checksum of a picture with its meshes."""
    cache = tmp_path_factory.mktemp("filled") / "meshes"
    processes = [filler(cache) for _ in range(2)]
    for process in processes:
        begin(process)
    (first, complaints), second = map(told_by, processes)
    assert (first, complaints) == second
    assert complaints == ""
    return cache, first


@pytest.mark.slow
@pytest.mark.sim
def test_two_processes_may_fill_the_cache_at_once(right):
    cache, _ = right
    assert len(complete(cache)) == DERIVED
    assert not list(cache.glob(".*"))


@pytest.mark.sim
@pytest.mark.slow
def test_damaged_meshes_are_made_anew_and_told(right):
    cache, picture = right
    sound = {path.name: path.read_bytes() for path in cache.iterdir()}
    harmed = [next(cache.glob(f"{name}-*")) for name in ("table", "link0")]
    harmed[0].write_bytes(sound[harmed[0].name][:-1000])
    raw = bytearray(sound[harmed[1].name])
    raw[len(raw) // 2] ^= 1
    harmed[1].write_bytes(raw)
    process = filler(cache)
    begin(process)
    out, complaints = told_by(process)
    assert out == picture
    for path in harmed:
        assert f"The cache entry {path} is damaged and will be rebuilt." in complaints
    assert complaints.count("damaged") == 2
    assert {path.name: path.read_bytes() for path in cache.iterdir()} == sound


@pytest.mark.slow
@pytest.mark.sim
def test_a_kill_while_meshes_are_written_leaves_no_bad_entry(right, cache):
    sound, picture = right
    caught = 0
    for number in range(3):
        process = filler(cache)
        begin(process)
        begun = set(cache.glob(".*")) if cache.is_dir() else set()
        while not (cache.is_dir() and set(cache.glob(".*")) - begun):
            if process.poll() is not None:
                break
            time.sleep(0.0002)
        time.sleep(0.0004 * number)
        process.kill()
        process.communicate(timeout=600)
        caught += len(complete(cache)) < DERIVED
        for name in complete(cache):
            assert (cache / name).read_bytes() == (sound / name).read_bytes()
        if not caught:  # it was done before the kill
            shutil.rmtree(cache)
    assert caught
    process = filler(cache)
    begin(process)
    assert told_by(process) == (picture, "")
    assert complete(cache) == complete(sound)


@pytest.mark.sim
def test_the_table_is_the_installed_one():
    stock = sapien.render.RenderShapeTriangleMesh(str(find_model_files().table))
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


def test_code_that_derives_is_part_of_the_key(cache, monkeypatch):
    cached_arrays("thing", b"", dict)
    monkeypatch.setattr(mesh_cache, "source_code", lambda *_: b"other code")
    cached_arrays("thing", b"", dict)
    assert len(complete(cache)) == 2
    assert robot_meshes.source_code("robot_meshes") != mesh_cache.source_code("robot_meshes")
