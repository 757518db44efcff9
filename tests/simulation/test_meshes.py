"""Derived meshes: exact, cached, and unaffected by damage to the cache."""

import re
import subprocess
import sys

import numpy as np
import pytest
import sapien.render
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays, scalar_dtypes

from roboirg.simulation.model_files import TABLE_FILE, find_model_files
from roboirg.simulation.rendering import mesh_cache, table_mesh
from roboirg.simulation.rendering.mesh_cache import cached_arrays, pack_arrays, unpack_arrays
from roboirg.util.cache import open_cache


@pytest.fixture
def mesh_folder(tmp_path, monkeypatch):
    """The folder of cached meshes, in a cache that is empty."""
    monkeypatch.setenv("ROBOIRG_CACHE", str(tmp_path))
    return tmp_path / "meshes"


def entries_in(mesh_folder):
    return list(mesh_folder.glob("[!.]*"))


arrays_by_name = st.dictionaries(
    st.text("abc_0123", min_size=1),
    arrays(scalar_dtypes(), array_shapes(min_dims=0, min_side=0)),
)


@settings(max_examples=12)
@given(arrays_by_name)
def test_packed_arrays_are_unpacked_bit_for_bit(packed):
    """Arrays of any type and shape, by name, are packed into bytes and read back: same order,
    types, shapes and bits."""
    unpacked = unpack_arrays(memoryview(pack_arrays(packed)))

    assert list(unpacked) == list(packed)
    for name, array in packed.items():
        again = unpacked[name]
        assert (again.dtype, again.shape) == (array.dtype, array.shape)
        assert again.tobytes() == array.tobytes()


def test_cached_arrays_are_computed_once_for_each_source(mesh_folder):
    """A source is the bytes of the file from which a mesh is derived."""
    computed = []

    def corners():
        computed.append("corners")
        return {"corners": np.array([[0, 1, 2], [3, 4, 5]])}

    cached_arrays("thing", b"first", corners)
    again = cached_arrays("thing", b"first", corners)
    cached_arrays("thing", b"second", corners)

    assert again["corners"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert len(computed) == 2
    assert len(entries_in(mesh_folder)) == 2


def test_cached_meshes_take_at_most_a_sixteenth_of_the_cache(mesh_folder, monkeypatch):
    """The cache may have 160,000 bytes; 20 meshes of 1,600 bytes do not fit into 10,000."""
    monkeypatch.setenv("ROBOIRG_CACHE_GIB", str(160_000 / 2**30))

    for number in range(20):
        cached_arrays("thing", bytes([number]), lambda: {"zeros": np.zeros(200)})

    kept = [path.stat().st_size for path in mesh_folder.iterdir()]
    assert len(kept) > 1
    assert sum(kept) <= 10_000


def test_meshes_that_fill_their_share_displace_no_recorded_actions(monkeypatch, mesh_folder):
    """The cache may have 160,000 bytes, a sixteenth of which, 10,000, is for meshes and as much for
    recorded actions. Actions of 5,000 bytes are kept although 20 meshes of 1,600 bytes, 32,000
    together, are written after them: these displace each other."""
    monkeypatch.setenv("ROBOIRG_CACHE_GIB", str(160_000 / 2**30))
    open_cache("actions").write("a1", bytes(5_000))

    for number in range(20):
        cached_arrays("thing", bytes([number]), lambda: {"zeros": np.zeros(1_600 // 8)})

    assert open_cache("actions").read("a1") == bytes(5_000)


PRINT_CHECKSUM_OF_PICTURE = """
import zlib, roboirg
print(zlib.crc32(roboirg.make("PickXtimes").reset()[0]["front_rgb"].tobytes()))
"""


def printed_by_a_process_that_draws():
    """Return the checksum of a picture that a new process prints, and its warnings."""
    done = subprocess.run(
        [sys.executable, "-c", PRINT_CHECKSUM_OF_PICTURE],
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout, done.stderr


def flip_a_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.slow
@pytest.mark.sim
def test_damaged_cached_meshes_are_rebuilt_with_a_warning(mesh_folder):
    """A process that draws leaves 13 files of meshes: of the table, of ten links of the robot, and
    of what each of two cameras sees of link 0. The file of the table is cut off, and in one of link
    0 a bit is flipped. The next process must draw the same picture and make both files again."""
    picture, _ = printed_by_a_process_that_draws()
    sound = {path: path.read_bytes() for path in mesh_folder.iterdir()}
    (table,) = mesh_folder.glob("table-*")
    link, _ = sorted(mesh_folder.glob("link0-*"))
    table.write_bytes(sound[table][:-1000])
    flip_a_bit(link)

    picture_after_damage, warnings = printed_by_a_process_that_draws()

    assert picture_after_damage == picture
    assert set(re.findall("entry (.*) is damaged and will be rebuilt", warnings)) == {
        str(table),
        str(link),
    }
    assert {path: path.read_bytes() for path in mesh_folder.iterdir()} == sound


@pytest.fixture(scope="module")
def installed_table_parts():
    """The parts of the table's model as SAPIEN reads it."""
    return sapien.render.RenderShapeTriangleMesh(str(find_model_files() / TABLE_FILE)).parts


@pytest.mark.sim
def test_our_reduced_table_mesh_has_the_geometry_of_the_installed_model(installed_table_parts):
    """`installed_table_parts` are those of the model file, as SAPIEN reads it. Ours are read from
    less data: corners, triangles, normals and texture coordinates must be equal."""
    ours = table_mesh.table_shape().parts

    for mine, theirs in zip(ours, installed_table_parts, strict=True):
        assert np.array_equal(mine.vertices, theirs.vertices)
        assert np.array_equal(mine.triangles, theirs.triangles)
        assert np.array_equal(mine.get_vertex_normal(), theirs.get_vertex_normal())
        assert np.array_equal(mine.get_vertex_uv(), theirs.get_vertex_uv())


@pytest.mark.sim
def test_what_our_table_leaves_out_of_its_material_has_no_effect(installed_table_parts):
    """Our table is drawn with one number, `METALLIC`, in place of the model's texture that says how
    metallic each point is, and without textures for emitted or transmitted light. In the installed
    model that texture, the blue channel as always in glTF, has this number everywhere, and there
    are none of the others."""
    material = installed_table_parts[0].material
    blue = 2

    metallic_of_255 = material.metallic_texture.download()[..., blue]

    assert (metallic_of_255 == 255 * table_mesh.METALLIC).all()
    assert material.emission_texture is None
    assert material.transmission_texture is None


@pytest.mark.sim
@pytest.mark.parametrize(
    ("name", "has_srgb_colors"),
    [("base_color_texture", True), ("normal_texture", False), ("roughness_texture", False)],
)
def test_textures_of_the_installed_table_are_sampled_as_ours(
    installed_table_parts, name, has_srgb_colors
):
    """Ours are made from pixels, with the renderer's defaults: one level of detail, repeated at the
    edges. The installed model's must have the same; colors alone are encoded as sRGB."""
    texture = getattr(installed_table_parts[0].material, name)

    assert texture.is_srgb == has_srgb_colors
    assert texture.mipmap_levels == 1
    assert texture.address_mode == "repeat"


def test_the_cache_key_of_a_mesh_changes_with_the_code_that_computes_it(mesh_folder, monkeypatch):
    """The same mesh of the same source is asked for before and after its code was replaced: it is
    computed again, so there are two files."""
    cached_arrays("thing", b"", dict)
    monkeypatch.setattr(mesh_cache, "source_code", lambda *_: b"other code")

    cached_arrays("thing", b"", dict)

    assert len(entries_in(mesh_folder)) == 2
