"""The kit for a machine with a GPU: its parts, its installation, and how pictures are compared."""

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from gpu.measure import difference
from gpu.pack import write_parts

ROOT = Path(__file__).parents[2]
SETTINGS = "src/roboirg/simulation/rendering/render_settings.py"


@pytest.fixture
def packed_kit(tmp_path):
    """The folder of a kit, not yet cut into parts: a wheel, a source tree and some numbers.

    The wheel has the module `thing`, the tree a file with settings of the simulator.
    """
    kit = tmp_path / "packed"
    (kit / "wheels").mkdir(parents=True)
    with zipfile.ZipFile(kit / "wheels" / "thing-1.0-py3-none-any.whl", "w") as wheel:
        wheel.writestr("thing.py", "name = 'thing'\n")
        wheel.writestr("thing-1.0.dist-info/METADATA", "Name: thing\nVersion: 1.0\n")
        wheel.writestr(
            "thing-1.0.dist-info/WHEEL",
            "Wheel-Version: 1.0\nGenerator: us\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        )
        wheel.writestr("thing-1.0.dist-info/RECORD", "thing.py,,\n")
    settings = kit / "trees" / "after" / SETTINGS
    settings.parent.mkdir(parents=True)
    settings.write_bytes((ROOT / SETTINGS).read_bytes())
    (kit / "python").write_text("{}.{}".format(*sys.version_info))
    (kit / "expected.npz").write_bytes(np.random.default_rng(0).bytes(5000))
    return kit


@pytest.fixture
def parts(packed_kit, tmp_path):
    """The folder with the parts of the kit, which are of 2,000 bytes, and their checksums."""
    out = tmp_path / "parts"
    assert len(write_parts(packed_kit, out, 2000)) >= 3
    return out


def install(parts):
    """Install parts to the folder `kit` next to them, as on a machine with this Python."""
    interpreter = parts.parent / "bin"
    interpreter.mkdir()
    (interpreter / "python3").symlink_to(sys.executable)
    return subprocess.run(
        ["bash", str(ROOT / "scripts/gpu/install"), str(parts), str(parts.parent / "kit")],
        env={"PATH": f"{interpreter}:/usr/bin:/bin", "HOME": str(parts.parent)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_parts_install_on_a_machine_that_reaches_nothing(tmp_path, parts):
    """A machine with a GPU may have no network, so all that it needs comes in files, the parts.

    `parts` has a wheel with the module thing.py, and this Python's version. The wheel is installed
    without an index of packages.
    """
    done = install(parts)

    assert done.returncode == 0, done.stderr
    assert (tmp_path / "kit" / "site" / "thing.py").read_text() == "name = 'thing'\n"


def test_the_installed_kit_has_the_source_with_culling_and_without(tmp_path, parts):
    """Culling is not to draw what a camera cannot see. To compare, the kit has the source twice.

    `parts` has it once, as it is here, with culling; the other tree, `unculled`, is made from it.
    SETTINGS is the path of the file that says whether culling is on.
    """
    install(parts)

    trees = tmp_path / "kit" / "trees"
    assert "culling: bool = True" in (trees / "after" / SETTINGS).read_text()
    assert "culling: bool = False" in (trees / "unculled" / SETTINGS).read_text()


def test_a_damaged_part_is_named_and_nothing_is_installed(tmp_path, parts):
    """`parts` has the parts of a kit, which are files with checksums. The last bit of the second
    part is flipped, as on a bad disk. The installation stops before it makes the folder of the kit.
    """
    part = parts / "part-01"
    content = bytearray(part.read_bytes())
    content[-1] ^= 1
    part.write_bytes(content)

    done = install(parts)

    assert done.returncode != 0
    assert "part-01" in done.stdout + done.stderr
    assert not (tmp_path / "kit").exists()


def test_another_python_is_refused_with_what_would_be_right(tmp_path, packed_kit):
    """A kit has packages for one version of Python. This one says that it is for Python 3.1, which
    the `python3` of the machine, a symbolic link to the Python of this test, is not."""
    (packed_kit / "python").write_text("3.1")
    write_parts(packed_kit, tmp_path / "parts", 10**6)

    done = install(tmp_path / "parts")

    assert done.returncode == 1
    assert re.search(r"python3 is 3\.\d+ here; the parts are for 3\.1 \(", done.stderr), done.stderr


def test_differences_are_counted_by_pixel_and_motion_by_bit():
    """Two pictures of 4 by 5 pixels, 40 in all. In one picture a pixel is off by one level, and
    another by 200, which is clear; the states of motion are equal, and those of events differ in
    the last bit."""
    black = np.zeros((4, 5, 3), np.uint8)
    spotted = black.copy()
    spotted[0, 0] = (0, 1, 0)
    spotted[0, 1] = (200, 9, 0)
    still = np.array([0.1, 0.2])

    found = difference(
        {"a": black, "b": black, "motion": still, "events": still},
        {"a": spotted, "b": black, "motion": still.copy(), "events": np.nextafter(still, 1)},
    )

    assert found == {
        "pixels": 40,
        "differ": 2 / 40,
        "differ clearly": 1 / 40,
        "largest": 200,
        "other motion": ["events"],
    }
    assert difference({"a": black}, {"b": black}) == {"only in one": ["a", "b"]}


def test_a_container_fetches_the_models_when_it_starts_and_then_runs_its_command(tmp_path):
    """A stand-in for `roboirg` prints the number of its arguments and these. The image itself has
    no models: no step before its entry point fetches them."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    steps, start, _ = re.split(r"ENTRYPOINT (.+)", text)
    (tmp_path / "roboirg").write_text('#!/bin/sh\necho "$# $*" >&2\n')
    (tmp_path / "roboirg").chmod(0o755)

    done = subprocess.run(
        [*json.loads(start), "run", "two words"],
        env={"PATH": f"{tmp_path}:/bin"},
        capture_output=True,
        check=True,
    )

    assert done.stderr == b"1 fetch-models\n2 run two words\n"
    assert "fetch-models" not in steps


def test_the_container_shows_the_driver_to_vulkan_and_to_egl():
    """The Dockerfile writes two files with `printf` that tell where the graphics driver is, one for
    Vulkan and one for EGL. Both are JSON and name libraries of NVIDIA's driver, which the host
    brings."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    written = re.findall(r"printf '(\{.*?)\\n' \\\n\s+> (\S+)", text)

    libraries = {path: json.loads(content)["ICD"]["library_path"] for content, path in written}

    assert libraries == {
        "/etc/vulkan/icd.d/nvidia_icd.json": "libGLX_nvidia.so.0",
        "/usr/share/glvnd/egl_vendor.d/10_nvidia.json": "libEGL_nvidia.so.0",
    }
