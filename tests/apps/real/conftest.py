"""Shared by the tests of studies with a real robot."""

import pytest

from roboirg.apps.real.study.study_plan import make_study, write_study


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
