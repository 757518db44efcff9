"""Made-up results, without simulator, language or files."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator

import pytest
from flat_jobs import make_result
from published_results import like_published

from roboirg.evaluation.records.record import Summary

MakeResult = Callable[..., Summary]


@pytest.fixture(scope="session")
def result() -> MakeResult:
    return make_result


@pytest.fixture(scope="session")
def published_like() -> Callable[..., list[Summary]]:
    return like_published


@pytest.fixture(scope="module")
def patient_sockets(wait_s: float) -> Iterator[None]:
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(wait_s)
    yield
    socket.setdefaulttimeout(before)
