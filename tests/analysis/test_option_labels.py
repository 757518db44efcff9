"""Labels and order of instruction options."""

from roboirg.analysis.results.option_labels import (
    has_default_options,
    options_label,
    options_sort_key,
)
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.settings import plain_settings, setting_names


def test_a_label_names_the_options_that_are_not_the_defaults():
    """In order: setting, form, stages, distractor kind and count, frame of spatial words."""
    options = InstructionOptions("contextual", "resolved", (1, 5), "competing", 3, "camera")
    assert options_label(options) == (
        "contextual (resolved, stages 1,5, competing distractor, 3 distractors, camera frame)"
    )
    assert options_label(InstructionOptions("direct")) == "direct"
    assert options_label(InstructionOptions("direct", delivery="turns")) == "direct (in turns)"


def test_options_are_sorted_by_setting_as_declared_with_unknown_settings_last():
    """Within a setting *implicit* comes before *resolved*, in which references are spelled out."""
    names = ["zeta", *reversed(setting_names()), "alpha"]
    options = [
        InstructionOptions(name, form) for name in names for form in ("resolved", "implicit")
    ]
    ordered = sorted(options, key=options_sort_key)
    assert [options.setting for options in ordered[::2]] == [*setting_names(), "alpha", "zeta"]
    assert {options.form for options in ordered[::2]} == {"implicit"}

    shown = dict.fromkeys(options.setting for options in ordered if has_default_options(options))
    assert list(shown) == [*plain_settings(), "alpha", "zeta"]
