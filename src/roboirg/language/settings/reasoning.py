"""The reasoning setting: the goal follows from an intermediate reference in the context.

The episodes of a task cycle through the patterns that they allow. The command states the slots
that the pattern does not cover.
"""

from __future__ import annotations

from roboirg.language.settings.setting import Setting

SETTING = Setting(
    name="reasoning",
    order=2,
    summary="the context gives an intermediate reference, from which the goal is derived",
    color="#D55E00",
    content_plans="reasoning",
    reads=frozenset({"delivery"}),
    example=3,
)
