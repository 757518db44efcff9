"""What is measured of runs: rates, gaps, failures, control arms, the headline, chance levels."""
