"""Pack what a bare machine with a GPU needs into parts that are small enough to send.

That machine has Python, pip and the GPU's driver, and reaches no other. The parts hold wheels, the
Vulkan loader, the model files, this commit and an earlier one, and pictures and motion of this
machine to compare with. Packages that the machine has (--there) are left out.

    python scripts/gpu/pack.py build/gpu --there numpy,scipy,opencv-python
    # there, with all files of build/gpu in one folder
    bash parts/install parts kit && bash kit/check results.json
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import typer
from packaging.utils import canonicalize_name, parse_wheel_filename

from roboirg.simulation.model_files import find_model_files

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
EXTRAS = "sim,remote"
GLIBC = (17, 24, 27, 28, 31, 34)
"""Minor versions of glibc 2 for which wheels are named; pip matches each exactly."""
LOADER = (
    *("libvulkan1", "libegl1", "libglvnd0"),
    # NVIDIA's Vulkan driver is linked with these, even without a display.
    *("libx11-6", "libxext6", "libxcb1", "libxau6", "libxdmcp6", "libbsd0", "libmd0"),
)
MIB = 1024**2


def main(
    out: Path, python: str = "3.12", there: str = "", before: str = "HEAD~1", part_mib: int = 40
) -> None:
    """Pack everything, and print the sizes.

    Args:
        out: folder for the parts, emptied first.
        python: version of Python there.
        there: packages that the machine has, with commas.
        before: commit to compare with.
        part_mib: largest size of a part.
    """
    with tempfile.TemporaryDirectory() as folder:
        kit = Path(folder)
        (kit / "python").write_text(python)
        _unpack_tree(before, kit / "trees" / "before")
        _unpack_tree("HEAD", kit / "trees" / "after")
        _download_wheels(kit / "wheels", python, there.split(","))
        _unpack_loader(kit / "loader")
        shutil.copytree(find_model_files(), kit / "models")
        _run(sys.executable, f"{HERE}/measure.py", "draw", f"{kit}/expected.npz")
        shutil.copy(HERE / "check", kit)
        shutil.rmtree(out, ignore_errors=True)
        parts = write_parts(kit, out, part_mib * MIB)
    shutil.copy(HERE / "install", out)
    for part in parts:
        print(f"{part}: {part.stat().st_size / MIB:.1f} MiB")


def write_parts(kit: Path, out: Path, size: int) -> list[Path]:
    """Write a folder's archive in parts of at most `size` bytes, with their SHA-256, to `out`."""
    out.mkdir(parents=True)
    archive = out / "kit.tar.gz"
    with tarfile.open(archive, "w:gz", compresslevel=6) as tar:
        tar.add(kit, arcname=".")
    parts: list[Path] = []
    with archive.open("rb") as file:
        while content := file.read(size):
            parts.append(out / f"part-{len(parts):02}")
            parts[-1].write_bytes(content)
    archive.unlink()
    sums = [f"{hashlib.sha256(part.read_bytes()).hexdigest()}  {part.name}" for part in parts]
    (out / "sums").write_text("\n".join(sums) + "\n")
    return parts


def _unpack_tree(commit: str, folder: Path) -> None:
    folder.mkdir(parents=True)
    archive = subprocess.run(  # noqa: S603 - our own command
        ["git", "archive", commit, "src", "scripts"],  # noqa: S607 - the developer's git
        check=True,
        capture_output=True,
        cwd=ROOT,
    )
    subprocess.run(["tar", "-x", "-C", str(folder)], input=archive.stdout, check=True)  # noqa: S603, S607


def _download_wheels(folder: Path, python: str, there: list[str]) -> None:
    """Download wheels of the package and all that it needs, for the other machine's Python."""
    _run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), str(ROOT))
    (own,) = folder.iterdir()
    platforms = ["manylinux2014_x86_64", *(f"manylinux_2_{minor}_x86_64" for minor in GLIBC)]
    _run(
        *(sys.executable, "-m", "pip", "download", "--quiet", "--only-binary=:all:"),
        *("--implementation", "cp", "--python-version", python, "-d", str(folder)),
        *(word for one in platforms for word in ("--platform", one)),
        f"{own}[{EXTRAS}]",
    )
    left_out = {canonicalize_name(name) for name in there}
    for wheel in folder.iterdir():
        if parse_wheel_filename(wheel.name)[0] in left_out:
            wheel.unlink()


def _unpack_loader(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as packages:
        Path(packages).chmod(0o777)  # apt downloads as a user of its own
        _run("apt-get", "download", "-qq", *LOADER, cwd=packages)
        for package in Path(packages).glob("*.deb"):
            _run("dpkg", "-x", str(package), str(folder))


def _run(*words: str, cwd: str | None = None) -> None:
    subprocess.run(words, check=True, cwd=cwd)  # noqa: S603 - our own commands


if __name__ == "__main__":
    typer.run(main)
