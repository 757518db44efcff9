"""What is learned from the simulator: a listener that names goals, and a policy that acts."""
