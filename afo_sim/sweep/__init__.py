"""Parameter sweeps: what is varied (plan), the cases that this makes (design), and their runs."""
