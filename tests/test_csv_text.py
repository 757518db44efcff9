"""Texts of strangers in CSV files: a spreadsheet shows them and computes none."""

from decimal import Decimal

import pytest

from roboirg.util.csv_text import csv_text


@pytest.mark.parametrize(
    "text", ["=cmd|' /C calc'!A0", "@SUM(1)", "+1+1", "-2+3", "-x", "\t=1", "-1 (A1+1)"]
)
def test_a_text_that_a_spreadsheet_would_compute_gets_an_apostrophe(text):
    """Names come from strangers; "=cmd|…" would start a program when the file is opened."""
    assert csv_text([{"name": text}]).strip() == f"name\n'{text}"


@pytest.mark.parametrize(
    "value",
    [
        Decimal("-3.2"),
        "-0.0125",
        "-5%",
        "pick-2=a",
        "-12.9 to -0.3",
        "+6.0 (0.0 to +14.0)",
        "-5.0 (too few)",
    ],
)
def test_numbers_intervals_and_plain_texts_are_written_to_csv_as_they_are(value):
    """Although some begin with a sign, as formulas do."""
    assert csv_text([{"change": value}]) == f"change\n{value}\n"


def test_no_rows_are_an_empty_file():
    assert csv_text([]) == ""
