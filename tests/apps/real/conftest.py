"""Shared by the tests of the real-robot kit."""

import sys
from pathlib import Path

import pytest

from roboirg.apps.real.study.study_plan import make_study, write_study

HERE = Path(__file__).parent
if str(HERE) not in sys.path:
    sys.path.append(str(HERE))  # for helpers, and policies in processes that are spawned


from real_start import end_all  # noqa: E402


@pytest.fixture(autouse=True)
def no_process_is_left():
    yield
    end_all()


@pytest.fixture
def small(tmp_path):
    """A plan of four trials of PutInBox, in its folder."""
    plan = make_study(
        ("listener", "forgetful"),
        tasks=("PutInBox",),
        settings=("explicit", "direct"),
        trials=1,
        demonstrations=0,
    )
    write_study(plan, tmp_path)
    return plan, tmp_path
