"""The words: an episode and a setting give an instruction; the resolver reads it back."""
