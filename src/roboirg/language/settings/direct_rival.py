"""Direct with a rival: two values are introduced alike, and the last words choose."""

from __future__ import annotations

from roboirg.language.rivals import pair_refusal
from roboirg.language.settings import direct
from roboirg.language.settings.setting import Setting

SETTING = Setting(
    name="direct-rival",
    order=direct.SETTING.order,
    summary="direct, with a second value of the same kind; the last words single one out",
    color="#56B4E9",
    content_plans="direct-rival",
    refusal=pair_refusal,
    reads=direct.SETTING.reads,
    example=2,
    plain=direct.SETTING.name,
)
