"""Checks of a user's files: `kinds` finds what a file is, the other modules show its content."""
