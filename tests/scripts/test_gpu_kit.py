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
def parts(tmp_path):
    """The parts of a kit of one wheel and one tree, with `python` as on this machine."""
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
    out = tmp_path / "parts"
    assert len(write_parts(kit, out, 2000)) >= 3
    return out


def install(parts):
    interpreter = parts.parent / "bin"
    interpreter.mkdir(exist_ok=True)
    if not (interpreter / "python3").exists():
        (interpreter / "python3").symlink_to(sys.executable)
    return subprocess.run(
        ["bash", str(ROOT / "scripts/gpu/install"), str(parts), str(parts.parent / "kit")],
        env={"PATH": f"{interpreter}:/usr/bin:/bin", "HOME": str(parts.parent)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_parts_install_on_a_machine_that_reaches_nothing(parts):
    done = install(parts)
    kit = parts.parent / "kit"

    assert done.returncode == 0, done.stderr
    assert (kit / "site" / "thing.py").read_text() == "name = 'thing'\n"
    assert "culling: bool = True" in (kit / "trees" / "after" / SETTINGS).read_text()
    assert "culling: bool = False" in (kit / "trees" / "unculled" / SETTINGS).read_text()


def test_a_damaged_part_is_named_and_nothing_is_installed(parts):
    """`parts` has the parts of a kit, with checksums. A bit of the second part is flipped."""
    part = parts / "part-01"
    content = bytearray(part.read_bytes())
    content[-1] ^= 1
    part.write_bytes(content)

    done = install(parts)

    assert done.returncode != 0
    assert "part-01" in done.stdout + done.stderr
    assert not (parts.parent / "kit").exists()


def test_another_python_is_refused_with_what_would_be_right(tmp_path, parts):
    """The kit is packed anew for Python 3.1, which is not this one."""
    kit = tmp_path / "packed"
    other = tmp_path / "others"
    (kit / "python").write_text("3.1")
    write_parts(kit, other, 10**6)

    done = install(other)

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


def test_the_container_shows_the_driver_to_vulkan_and_to_egl():
    """Both files are JSON and name libraries of NVIDIA's driver, which the host brings."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    files = {
        path: json.loads(content.removesuffix(r"\n"))
        for content, path in re.findall(r"printf '(\{.*?)' \\\n\s+> (\S+)", text)
    }
    assert {path: content["ICD"]["library_path"] for path, content in files.items()} == {
        "/etc/vulkan/icd.d/nvidia_icd.json": "libGLX_nvidia.so.0",
        "/usr/share/glvnd/egl_vendor.d/10_nvidia.json": "libEGL_nvidia.so.0",
    }
