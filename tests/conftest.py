"""Shared by all tests: Hypothesis's profile, no cache but a test's own, and Ctrl-C that works."""

import os
import signal

from hypothesis import HealthCheck, settings

# Examples are derived from the test, not from the clock: CI finds what a laptop finds.
settings.register_profile(
    "roboirg", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("roboirg")

# What an earlier version left in the user's cache must not decide a test.
os.environ["ROBOIRG_CACHE"] = "off"

# A shell starts background jobs with SIGINT ignored, which programs under test would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
