"""Doctor for a user's files: `kinds` sees what a file is, the other modules say what is in it."""
