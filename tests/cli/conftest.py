"""What tests of the command line share."""

import pytest
from figures import leave_blank


@pytest.fixture
def blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are written, and nothing is on them."""
    leave_blank(monkeypatch)
