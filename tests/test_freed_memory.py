"""Freed memory is used again without new pages."""

import sys

import pytest
from python_process import print_of_python

PROGRAM_THAT_COUNTS_NEW_PAGES = """
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


def page_faults(mode):
    """Return how often a process asks the system for a new page, while it draws 200 pictures.

    Args:
        mode: "keep" to use freed memory again, "not" to leave it to the system.
    """
    return int(print_of_python("-c", PROGRAM_THAT_COUNTS_NEW_PAGES, mode))


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's memory")
def test_freed_memory_is_used_again_without_asking_the_system_for_new_pages():
    """200 pictures of 1 MiB have 51,200 pages of 4 KiB. With freed memory kept, less than a
    twentieth of them is asked for; without, more than half, which made rendering slow."""
    assert page_faults("keep") < 2_560
    assert page_faults("not") > 25_600
