"""Anybody's leg: read from MJCF and URDF, cut out of a body, turned, attached to, and written again."""
