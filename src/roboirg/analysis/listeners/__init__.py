"""What a study of listeners shows beside their success: agreement, time, attention."""
