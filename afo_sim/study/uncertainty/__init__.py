"""Bands of a run's numbers: what is not known is drawn together, and each draw's settled stride is solved."""
