"""Controllers: what the device's electronics see, and what they command, at a control rate."""
