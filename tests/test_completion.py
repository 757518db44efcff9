"""Completion in a real bash, with the script that `roboirg --show-completion` prints."""

import os
import shutil
import subprocess
import sys

import pytest

COMPLETE_IN_BASH = """
eval "$(_ROBOIRG_COMPLETE=source_bash roboirg)"
complete -p roboirg >/dev/null || exit 3
COMP_WORDS=(roboirg "$@") COMP_CWORD=$#
_roboirg_completion roboirg
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
@pytest.mark.parametrize(
    ("words", "completed"),
    [(["ta"], {"tables", "tasks"}), (["run", "--retry"], {"--retry-errors"})],
)
def test_bash_completes_commands_and_options(tmp_path, words, completed):
    """A real bash loads the script that the command prints for it, and completes the last of these
    words; `completed` are all suggestions."""
    command = tmp_path / "roboirg"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m roboirg "$@"\n')
    command.chmod(0o755)

    done = subprocess.run(
        ["bash", "--norc", "-c", COMPLETE_IN_BASH, "bash", *words],
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )

    assert (done.returncode, done.stderr) == (0, "")
    assert set(done.stdout.split()) == completed
