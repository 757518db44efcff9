"""Labels and order of instruction options."""

from roboirg.analysis.results.option_labels import (
    has_default_options,
    options_label,
    options_sort_key,
)
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.settings import plain_settings, setting_names


def test_labels_name_what_differs_from_the_defaults():
    options = InstructionOptions("contextual", "resolved", (1, 5), "competing", 3, "camera")
    assert options_label(options) == (
        "contextual (resolved, stages 1,5, competing distractor, 3 distractors, camera frame)"
    )
    assert options_label(InstructionOptions("direct")) == "direct"
    assert options_label(InstructionOptions("direct", delivery="turns")) == "direct (in turns)"


def test_settings_have_the_order_of_the_language_and_unknown_ones_are_last():
    names = ["zeta", *reversed(setting_names()), "alpha"]
    options = [
        InstructionOptions(name, form) for name in names for form in ("resolved", "implicit")
    ]
    ordered = sorted(options, key=options_sort_key)
    assert [options.setting for options in ordered[::2]] == [*setting_names(), "alpha", "zeta"]
    assert {options.form for options in ordered[::2]} == {"implicit"}

    shown = dict.fromkeys(options.setting for options in ordered if has_default_options(options))
    assert list(shown) == [*plain_settings(), "alpha", "zeta"]
