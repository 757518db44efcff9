"""The contextual setting: direct, with reinforcement, distractors and a cue before the command."""

from __future__ import annotations

import itertools

from roboirg.language.request import DISTRACTORS, STAGE_SETS
from roboirg.language.settings.setting import Setting

SETTING = Setting(
    name="contextual",
    order=3,
    summary="direct, with reinforcement, a distractor and a cue before the command",
    color="#009E73",
    content_plans="contextual",
    reads=frozenset({"stages", "distractor", "distractors", "delivery"}),
    variants=tuple(
        {"stages": stages, "distractor": distractor}
        for stages, distractor in itertools.product(STAGE_SETS, DISTRACTORS)
    ),
    example=1,
)
