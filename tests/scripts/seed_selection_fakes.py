"""Judges of seeds for the tests, in a module that worker processes can import."""

import os

from seed_selection import Rejection


def take_the_third(slot, seed):
    """Refuses two seeds of each slot."""
    return Rejection(seed, "no room", "no place for cube") if seed % 100 < 2 else None


def refuse(slot, seed):
    return Rejection(seed, "oracle failed", "timeout")


def die(slot, seed):
    os._exit(3)
