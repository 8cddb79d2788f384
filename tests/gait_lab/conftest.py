"""The walk that the room's tests know."""

import pytest
from walking import Walk, known_walk


@pytest.fixture(scope="session")
def walk() -> Walk:
    """The shipped stride, stride after stride."""
    return known_walk()
