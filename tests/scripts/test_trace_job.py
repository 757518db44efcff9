"""A job passes the rooms from above to below and asks none twice."""

from __future__ import annotations

from trace_job import follow

MOST_STAYS = 30


def test_a_job_stays_in_few_rooms_and_climbs_to_none() -> None:
    found = follow()
    assert len(found) <= MOST_STAYS
    assert [stay for stay in found if stay.kind == "climb"] == []
