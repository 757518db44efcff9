"""Sockets that wait for a busy machine."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def patient_sockets(wait_s: float) -> Iterator[None]:
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(wait_s)
    yield
    socket.setdefaulttimeout(before)
