"""Description → MjSpec → MjModel: leg, orthosis, walking, contact, controls and starting state."""
