"""What a check of a policy says."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Literal, NamedTuple

from roboirg.core.error_words import one_line

Verdict = Literal["pass", "fail", "warn", "note"]


class CheckResult(NamedTuple):
    """The result of one check.

    Attributes:
        check: its name.
        verdict: pass; fail for what is certainly wrong; warn for what a correct policy rarely does;
            note for what is allowed but worth knowing.
        message: what was seen, what it usually means, and what to change.
    """

    check: str
    verdict: Verdict
    message: str


class CheckAbortedError(Exception):
    """The checks cannot go on; the arguments are those of the last `CheckResult`."""


@contextlib.contextmanager
def ending_checks(check: str, call: str = "") -> Iterator[None]:
    """Let any exception of the policy's own code, in the block, end all checks as a failure.

    For checks on which the later ones rely.

    Args:
        check: its name.
        call: of the policy that is made, such as ``"reset(): "``; the message begins with it.

    Raises:
        CheckAbortedError: instead of the exception.
    """
    try:
        yield
    except (Exception, SystemExit) as error:
        raise CheckAbortedError(check, "fail", f"{call}{describe_error(error)}") from error


def describe_error(error: BaseException) -> str:
    """Return an error as one sentence of limited length, with its place in the policy's code."""
    return one_line(error).rstrip(".") + "."
