"""The functions of scripts/setup, sourced by bash and fed with made-up apt sources."""

import shutil
import subprocess
from pathlib import Path

import pytest

SETUP = Path(__file__).parent.parent / "scripts" / "setup"

SOURCE_IN_DEB822_FORMAT = """\
# a comment
Types: deb deb-src
URIs: http://mirror.example/debian
Suites: bookworm bookworm-updates
Components: main contrib
Signed-By: /usr/share/keyrings/archive.gpg

Enabled: no
Types: deb
URIs: http://off.example/debian
Suites: bookworm
Components: main
"""


def bash(code, apt_dir=None):
    environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}
    if apt_dir is not None:
        environment["ROBOIRG_APT_DIR"] = str(apt_dir)
    return subprocess.run(
        ["bash", "-c", f"source '{SETUP}'; {code}"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def apt_dir(tmp_path):
    (tmp_path / "sources.list.d").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("version", "enough"),
    [
        ("22.3.6-1+deb12u2", False),
        ("23.2.1-1ubuntu3.1~22.04.3", True),
        ("25.0.7-2~bpo12+1", True),
        ("1:23.10-1", True),
        ("9.0", False),
        ("(none)", False),
        ("", False),
    ],
)
def test_a_version_of_mesa_is_compared_with_23_2_as_a_number(version, enough):
    """Debian adds an epoch before and a revision after it; as text, 9.0 would be enough."""
    assert (bash(f"version_at_least '{version}' 23.2").returncode == 0) is enough


def test_backports_use_the_mirror_and_key_of_a_deb822_source(apt_dir):
    (apt_dir / "sources.list.d" / "debian.sources").write_text(SOURCE_IN_DEB822_FORMAT)
    assert bash("backports_source bookworm", apt_dir).stdout == (
        "Types: deb\n"
        "URIs: http://mirror.example/debian\n"
        "Suites: bookworm-backports\n"
        "Components: main\n"
        "Signed-By: /usr/share/keyrings/archive.gpg\n"
    )


def test_a_key_inside_the_source_is_kept_as_it_is(apt_dir):
    (apt_dir / "sources.list.d" / "ubuntu.sources").write_text(
        "Types: deb\n"
        "URIs: http://mirror.example/ubuntu\n"
        "Suites: noble\n"
        "Components: main\n"
        "Signed-By:\n -----BEGIN PGP PUBLIC KEY BLOCK-----\n .\n abc=\n"
    )

    source = bash("backports_source noble", apt_dir).stdout

    assert "Suites: noble-backports\n" in source
    assert source.endswith("\n -----BEGIN PGP PUBLIC KEY BLOCK-----\n .\n abc=\n")


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ("", ""),
        ("[arch=amd64 signed-by=/k.gpg] ", "/k.gpg"),
        ("[ signed-by=/k.gpg arch=amd64 ] ", "/k.gpg"),
    ],
)
def test_backports_use_the_mirror_and_key_of_a_one_line_source(apt_dir, options, key):
    """But not those of source packages or of security updates."""
    (apt_dir / "sources.list").write_text(
        "# deb no\n"
        "deb-src http://source.example/debian bookworm main\n"
        "deb http://security.example/debian bookworm-security main\n"
        f"deb {options}http://mirror.example/debian bookworm main # why\n"
    )

    source = bash("backports_source bookworm", apt_dir).stdout

    assert "URIs: http://mirror.example/debian\nSuites: bookworm-backports\n" in source
    assert source.partition("Signed-By: ")[2].strip() == key


def test_source_files_that_apt_ignores_give_no_mirror(apt_dir):
    line = "deb http://wrong.example/debian bookworm main\n"
    for name in ("a.list.disabled", "b.list~", "c.save", "d,e.list"):
        (apt_dir / "sources.list.d" / name).write_text(line)

    assert bash("archives", apt_dir).stdout == ""
    assert bash("backports_source bookworm", apt_dir).returncode == 1


def administrator_commands(apt_dir, mesa, packages):
    """Return the commands to install packages, where apt would install some version of Mesa."""
    fakes = f"mesa_candidate() {{ echo {mesa}; }}; distribution_codename() {{ echo bookworm; }}; "
    code = f"administrator_commands ${{{packages}_PACKAGES[*]}}"
    return bash(fakes + code, apt_dir).stdout


def test_commands_for_the_administrator_add_backports_if_mesa_is_too_old(apt_dir):
    (apt_dir / "sources.list.d" / "debian.sources").write_text(SOURCE_IN_DEB822_FORMAT)

    commands = administrator_commands(apt_dir, "22.3.6-1", "VULKAN")

    assert commands.startswith(f"cat > {apt_dir}/sources.list.d/roboirg-backports.sources <<'END'")
    assert commands.endswith(
        "apt-get update\napt-get install --target-release bookworm-backports "
        "mesa-vulkan-drivers libvulkan1 libegl1\n"
    )


@pytest.mark.parametrize(
    ("mesa", "packages", "names"),
    [
        ("25.0.7-2", "VULKAN", "mesa-vulkan-drivers libvulkan1 libegl1"),
        ("22.3.6-1", "OPENCV", "libgl1 libglib2.0-0"),
    ],
)
def test_commands_for_the_administrator_add_no_backports_without_need(
    apt_dir, mesa, packages, names
):
    """OpenCV needs no newer Mesa."""
    commands = administrator_commands(apt_dir, mesa, packages)

    assert commands == f"apt-get update\napt-get install {names}\n"


FUNCTIONS_THAT_INSTALL_NOTHING = """
make_venv() {
    mkdir -p .venv/bin
    printf '#!/bin/sh\n' | tee .venv/bin/python >.venv/bin/roboirg
    chmod +x .venv/bin/*
}
install_python_packages() { say "installing [$1]"; }
ensure_libraries() { :; }
"""


@pytest.fixture
def checkout(tmp_path):
    """A checkout in which nothing is set up, and of which only the set-up script is real."""
    (tmp_path / "scripts").mkdir()
    shutil.copy(SETUP, tmp_path / "scripts")
    (tmp_path / "pyproject.toml").write_text("[project]")
    (tmp_path / "packages" / "learn").mkdir(parents=True)
    (tmp_path / "packages" / "learn" / "pyproject.toml").touch()
    return tmp_path


def extras_installed_by(checkout, words=""):
    """Set the checkout up; return which sets of extras were installed."""
    done = subprocess.run(
        ["bash", "-c", f"source scripts/setup; {FUNCTIONS_THAT_INSTALL_NOTHING} main {words}"],
        cwd=checkout,
        capture_output=True,
        text=True,
        check=True,
    )
    return [line.partition("installing ")[2] for line in done.stdout.splitlines() if "[" in line]


def test_setup_installs_the_extras_of_users_once(checkout):
    assert extras_installed_by(checkout) == ["[sim,report]"]
    assert extras_installed_by(checkout) == []


def test_setup_dev_adds_the_packages_of_developers_once(checkout):
    extras_installed_by(checkout)

    assert extras_installed_by(checkout, "dev") == ["[sim,report,dev]"]
    assert extras_installed_by(checkout, "dev") == []


def test_setup_installs_nothing_after_setup_dev(checkout):
    extras_installed_by(checkout, "dev")

    assert extras_installed_by(checkout) == []


def test_setup_installs_again_after_the_requirements_have_changed(checkout):
    extras_installed_by(checkout, "dev")
    (checkout / "pyproject.toml").write_text("[project]\ndependencies = []")

    assert extras_installed_by(checkout) == ["[sim,report]"]
    assert extras_installed_by(checkout, "dev") == ["[sim,report,dev]"]


def test_an_unknown_argument_of_set_up_is_refused():
    done = bash("main docs")
    assert done.returncode == 1
    assert "unknown argument 'docs'" in done.stderr


@pytest.mark.parametrize(
    ("target", "setup"),
    [
        ("demo", "scripts/setup"),
        ("play", "scripts/setup"),
        ("setup", "scripts/setup"),
        ("lint", "scripts/setup dev"),
        ("test", "scripts/setup dev"),
        ("test-slow", "scripts/setup dev"),
        ("test-all", "scripts/setup dev"),
        ("docs", "scripts/setup dev"),
        ("dist", "scripts/setup dev"),
        ("card", "scripts/setup dev"),
    ],
)
def test_make_targets_for_developers_run_setup_dev_and_others_run_setup(target, setup):
    dry = subprocess.run(
        ["make", "--dry-run", target],
        cwd=SETUP.parents[1],
        capture_output=True,
        text=True,
        check=True,
    )

    assert [line for line in dry.stdout.splitlines() if "scripts/setup" in line] == [setup]
