"""The direct setting: an introduction names every value, and the command points back."""

from __future__ import annotations

from roboirg.language.settings.setting import Setting

SETTING = Setting(
    name="direct",
    order=1,
    summary="an introduction names every value; the command points back at it",
    color="#0072B2",
    content_plans="direct",
    reads=frozenset({"delivery"}),
    example=2,
)
