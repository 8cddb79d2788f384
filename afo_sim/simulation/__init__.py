"""Compiled model and controls → Recording, its files and its checks."""
