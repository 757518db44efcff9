"""The explicit setting: one command states every slot."""

from __future__ import annotations

from roboirg.language.settings.setting import Setting

SETTING = Setting(
    name="explicit",
    order=0,
    summary="one command states every value",
    color="#000000",
    content_plans="explicit",
    implicit=False,
)
