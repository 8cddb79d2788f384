"""A scenario that runs without this package: a plugin of MuJoCo's, a library for C, or an FMU."""
