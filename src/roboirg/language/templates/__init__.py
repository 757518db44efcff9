"""The wordings that all tasks share. Every change needs a new `LANGUAGE_VERSION`.

`phrases` explains fields and alternatives. American spelling, as in the data that policies are
trained on. Training and test have wordings of their own (`roboirg.core.word_pools`). They are
short, because many policies cut what they hear after 64 tokens, some after 48; a test counts.
"""

LANGUAGE_VERSION = "3.0.0"
LANGUAGE_VERSIONS = {3: LANGUAGE_VERSION, 4: "4.4.0"}
"""The versions that can be asked for; the first is the default."""
DRAWS = "2.1.0"
"""Key of all random draws: an older version, so that only the words that were mended changed."""
