"""Every message that a tab may send, as the page sends it and in all wrong ways."""

import json
import random
import re
from typing import Any

import pytest
from campaign import SEED, size

from afo_sim.common import InputError
from afo_sim.studio.messages import MESSAGES, read_message

SAMPLES: dict[str, dict[str, Any]] = {  # of each kind, with all its fields
    **{op: {} for op in ("undo", "redo", "keep", "bands", "report", "stop")},
    "change": {"sets": {"supply.pressure": 3.5, "shoe": None}, "follow": True, "join": False},
    "show": {"slot": "A"},
    "remove": {"slot": "B"},
    "rename": {"slot": "C", "name": "low"},
    "save": {"folder": "runs/studio"},
    "import": {"files": ["trial.c3d"], "walker": "patient", "side": "left"},
    "search": {"keys": {"supply.pressure": [2.0, 4.2]}, "objective": "air_per_stride"},
}
JUNK: list[Any] = [
    None,
    True,
    -1,
    10**400,
    1e308,
    float("inf"),
    float("nan"),
    "",
    "\0",
    "\ud800",
    "x" * 10**5,
]
JUNK += [[], {}, [[]], [None] * 1000, {"a": {"b": {}}}, {"": ""}, ["\0"], [[[[1]]]], {"a\n": [1, 2, 3]}]
OWN_WORDS = re.compile(r"[A-Z]\w+Error|Errno|NoneType|pydantic|Input should")


def test_every_kind_has_a_sample_that_is_taken_whole() -> None:
    assert SAMPLES.keys() == MESSAGES.keys()
    for op, sample in SAMPLES.items():
        message = {"op": op, "key": "", **sample}
        assert read_message(json.loads(json.dumps(message))).model_dump() == message


@pytest.mark.parametrize("op", MESSAGES)
def test_what_is_wrong_is_one_sentence_that_names_its_field(op: str) -> None:
    for name in [*SAMPLES[op], "key"]:
        with pytest.raises(InputError, match=r"allowed: .+"):
            read_message({"op": op, **SAMPLES[op], "wrong": 1})
        with pytest.raises(InputError) as refused:
            read_message({"op": op, **SAMPLES[op], name: {"a": {"b": [[[1]]]}}})
        assert refused.value.field in (name, "a") and not OWN_WORDS.search(str(refused.value))
    for name in SAMPLES[op].keys() & {"sets", "slot", "files", "walker", "keys"}:
        with pytest.raises(InputError, match=name):
            read_message({"op": op, **{key: each for key, each in SAMPLES[op].items() if key != name}})


def test_junk_is_refused_or_within_the_bounds() -> None:
    draw = random.Random(SEED)
    for _ in range(size(500, 20_000)):
        op = draw.choice([*MESSAGES])
        message = {"op": op, **SAMPLES[op]}
        message[draw.choice([*message, "key", "x"])] = draw.choice(JUNK)
        try:
            taken = read_message(message)
        except InputError as error:
            assert error.field and len(str(error)) < 600 and not OWN_WORDS.search(str(error))
        else:
            assert len(json.dumps(taken.model_dump(), allow_nan=False)) < 20_000
