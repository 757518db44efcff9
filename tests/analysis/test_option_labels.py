"""Labels and order of instruction options."""

import pytest

from roboirg.analysis.results.option_labels import has_default_options, options_sort_key
from roboirg.core.instruction_options import InstructionOptions, options_label
from roboirg.language.settings import plain_settings, setting_names


@pytest.mark.parametrize(
    ("options", "label"),
    [
        (InstructionOptions("direct"), "direct"),
        (InstructionOptions("direct", delivery="turns"), "direct (in turns)"),
        (
            InstructionOptions("contextual", "resolved", (1, 5), "competing", 3, "camera"),
            "contextual (resolved, stages 1,5, competing distractor, 3 distractors, camera frame)",
        ),
    ],
)
def test_a_label_names_the_options_that_are_not_the_defaults(options, label):
    """In order: setting, form, stages, distractor kind and count, frame of spatial words."""
    assert options_label(options) == label


def test_options_are_sorted_by_setting_as_declared_with_unknown_settings_last():
    """No setting is called zeta or alpha; these two come in alphabetical order."""
    names = ["zeta", *reversed(setting_names()), "alpha"]

    ordered = sorted([InstructionOptions(name) for name in names], key=options_sort_key)

    assert [options.setting for options in ordered] == [*setting_names(), "alpha", "zeta"]


def test_within_a_setting_implicit_instructions_come_before_resolved_ones():
    """*Resolved* spells references out."""
    resolved = InstructionOptions("direct", "resolved")
    implicit = InstructionOptions("direct", "implicit")

    assert sorted([resolved, implicit], key=options_sort_key) == [implicit, resolved]


def test_default_options_are_those_of_a_plain_setting_or_of_an_unknown_one():
    """A setting that is another one with something added, such as a rival, is not plain."""
    names = [*setting_names(), "alpha"]

    plain = [name for name in names if has_default_options(InstructionOptions(name))]

    assert plain == [*plain_settings(), "alpha"]
