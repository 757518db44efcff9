"""Records: one JSON object per episode, stored, merged and exported."""
