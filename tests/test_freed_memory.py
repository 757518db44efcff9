"""Freed memory is used again without new pages."""

import subprocess
import sys

import pytest

PROGRAM = """
import resource, sys
from roboirg.util.freed_memory import keep_freed_memory

if sys.argv[1] == "keep":
    keep_freed_memory()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
def use():
    return [bytearray(b"x") * 2**20 for _ in range(10)]
use()
before = faults()
for _ in range(20):
    use()
print(faults() - before)
"""
PAGES = 20 * 10 * 2**20 // 4096


def page_faults(mode):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, mode], check=True, capture_output=True, text=True
    )
    return int(done.stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's memory")
def test_pictures_take_the_place_of_those_before_them():
    assert page_faults("keep") < PAGES / 20
    assert page_faults("not") > PAGES / 2
