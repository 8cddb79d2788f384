"""Frozen descriptions of muscle, orthosis, leg, patient and scenario, and the reader of their files."""
