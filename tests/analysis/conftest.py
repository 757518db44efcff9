"""Sockets that wait for a busy machine."""

from __future__ import annotations

import socket

import pytest


@pytest.fixture(scope="module")
def patient_sockets(wait_s):
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(wait_s)
    yield
    socket.setdefaulttimeout(before)
