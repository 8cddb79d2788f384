"""The muscle test stand and hanging masses."""
