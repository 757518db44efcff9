"""Records of episodes: one JSON object each, stored, merged and packed."""
