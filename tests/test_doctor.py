"""The doctor, on this machine and on machines with something missing."""

import re
import signal
import subprocess
from importlib import metadata

import pytest
from python_process import run_python

from roboirg.cli import doctor
from roboirg.cli.doctor import Check


def run_module(*arguments, **environment):
    return run_python("-m", "roboirg.cli.doctor", *arguments, timeout=600, **environment)


@pytest.mark.sim
def test_the_doctor_passes_all_checks_on_a_machine_with_everything():
    """Of two cameras, so an even number; a picture that is not drawn anew would take no time."""
    text = doctor.report(doctor.run_checks(render_s=1))

    assert text.endswith("All checks passed.")
    assert re.search(r"ok    1 s of pictures +\d*[02468] pictures in 1 s\n", text), text


def test_without_vulkan_the_doctor_names_what_to_unset_or_install():
    """Both variables name a driver's file that does not exist, so there is no driver for
    pictures."""
    result = run_module(VK_DRIVER_FILES="/nonexistent", VK_ICD_FILENAMES="/nonexistent")

    assert result.returncode == 1
    assert "not tried: no device" in result.stdout
    assert (
        "unset VK_ICD_FILENAMES (now '/nonexistent') and VK_DRIVER_FILES (now '/nonexistent'), or "
        "run `make setup`, or install Mesa >= 23.2: apt-get install mesa-vulkan-drivers"
    ) in result.stdout


@pytest.mark.sim
def test_an_unknown_render_device_is_named_with_the_known_ones():
    result = run_module("--frame", ROBOIRG_RENDER_DEVICE="cuda:77")

    assert (result.returncode, result.stderr.count("\n")) == (1, 1), "no traceback"
    assert "'cuda:77' does not exist; set ROBOIRG_RENDER_DEVICE to one of " in result.stderr


def test_a_missing_or_old_package_is_named_with_the_command_that_installs_it(monkeypatch):
    """Replaced are the versions that are installed and those that are required. numpy is missing
    and av too old; jinja2 is not the final version, which is fine; ruff is of the extra of
    developers, and is not looked at; another build of OpenCV counts as OpenCV."""
    headless = "opencv-contrib-python-headless"
    versions = {"roboirgbench": "0.1.0", "av": "9.2", "sapien": "3.0.3", "jinja2": "3.2rc1"}
    versions[headless] = "5.0"

    def version(name):
        if name not in versions:
            raise metadata.PackageNotFoundError(name)
        return versions[name]

    requirements = [
        "numpy>=1.26",
        "av>=12; extra == 'sim'",
        "sapien==3.0.3; extra == 'sim'",
        "opencv-python>=4.9; extra == 'sim'",
        "jinja2>=3; extra == 'report'",
        "ruff>=0.6; extra == 'dev'",
    ]
    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setattr(metadata, "packages_distributions", lambda: {"cv2": [headless]})
    monkeypatch.setattr(metadata, "requires", lambda _: requirements)

    assert list(doctor._check_packages()) == [
        Check("roboirgbench", True, "0.1.0"),
        Check("numpy", False, "not installed; needs >=1.26", "pip install 'numpy>=1.26'"),
        Check("av", False, "9.2; needs >=12", "pip install 'av>=12'"),
        Check("sapien", True, "3.0.3"),
        Check(headless, True, "5.0"),
        Check("jinja2", True, "3.2rc1"),
    ]


def test_missing_robot_models_are_reported_with_the_command_that_fetches_them(
    tmp_path, monkeypatch
):
    """The variable names an empty folder for the models."""
    monkeypatch.setenv("ROBOIRG_MODEL_FILES", str(tmp_path))
    check = doctor._check_files()[0]

    assert not check.ok
    assert str(tmp_path) in check.found
    assert check.remedy.startswith("run: roboirg fetch-models")


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (-signal.SIGSEGV, "drawn, then the process crashed (Segmentation fault)"),
        (-signal.SIGALRM, "drawn, then no picture within 120 s"),
    ],
)
def test_a_crash_of_the_driver_is_a_failed_check(monkeypatch, code, words):
    """The process that draws is replaced by one that has printed the device and "drawn", and then
    ended with a signal: a crash, or the alarm of a picture that takes too long."""
    crash = subprocess.CompletedProcess([], code, "a card\ndrawn\n", "")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: crash)

    device, frame = doctor._check_rendering()

    assert device.ok
    assert (frame.ok, frame.found) == (False, words)


def test_the_doctor_prints_what_to_do_below_each_failed_check():
    text = doctor.report([Check("a", True, "1"), Check("bb", False, "none", "install b")])
    assert text.splitlines() == [
        "ok    a   1",
        "FAIL  bb  none",
        "          -> install b",
        "1 of 2 checks failed.",
    ]
