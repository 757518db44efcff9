"""Shared by all tests: how strictly Hypothesis looks, and no cache but a test's own."""

import os

from hypothesis import HealthCheck, settings

# Examples are derived from the test, not from the clock: CI finds what a laptop finds.
settings.register_profile(
    "roboirg", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("roboirg")

# What an earlier version left in the user's cache must not decide a test.
os.environ["ROBOIRG_CACHE"] = "off"
