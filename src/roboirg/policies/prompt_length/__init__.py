"""How much of an instruction a policy's language model reads before its prompt is cut."""
