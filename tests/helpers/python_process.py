"""Python with words of a command line, such as ``-c`` and a program, in a process of its own."""

import os
import subprocess
import sys


def run_python(*words, cwd=None, timeout=None, **environment):
    """Return how Python ended, with what it printed as text; variables are added to ours.

    It may take `timeout` seconds, as long as it wants if that is None.
    """
    return subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=timeout,
    )


def print_of_python(*words, **options):
    """Return what Python prints, which must succeed; options are those of `run_python`."""
    ended = run_python(*words, **options)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout
