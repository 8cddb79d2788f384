"""Each control of the studio moves a number of its answer, or is shown with the reason why it moves none."""

import contextlib
import functools
import json
import os
import pathlib
from collections.abc import Iterator
from typing import Any

import pytest
from campaign import sampled
from compensating_patient import write_patient
from installed import needs

from afo_sim.common import InputError, SimulationError, assets
from afo_sim.model import person_of
from afo_sim.studio import Design, controls, opened
from afo_sim.studio.answers import Answers
from afo_sim.studio.controls import idle, read

pytestmark = needs("uvicorn", "websockets")
WALKS = [name for name in assets.names("scenario") if name.startswith("walk-")]
OWN = "own walk"
NOWHERE = pathlib.Path(os.devnull)  # nothing is written
LOOSE = {  # of short links: nothing fills these muscles, and at no slack of the slider are they pulled taut
    ("walk-dropfoot-afo-short", "orthosis.muscle.plantarflexor.slack")
}


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A patient's own walk, whose ankle hangs 15° in swing, made up for by knee and hip."""
    out = tmp_path_factory.mktemp("own") / "patient.csv"
    return str(write_patient(assets.find_gait("bovi2011_natural"), out, 15.0, 12.0, 8.0))


def start(walk: str, own: str) -> Design:
    return Design(*(("walk-dropfoot-afo", {"gait.cycle": own}) if walk == OWN else (walk, {})))


def silent(done: int, total: int, what: str = "") -> None:
    """Of how far a run is."""


def unlike(one: Design, other: Design) -> bool:
    """Whether the answers of two designs differ in a number: of the settled stride, or else of the run."""
    for whole in (False, True):
        found = [numbers(design, whole=whole) for design in (one, other)]
        if "" not in found and found[0] != found[1]:
            return True
    return False


def numbers(design: Design, *, whole: bool) -> str:
    """Of the settled stride, or of the whole run; "" of one that does not settle."""
    sets = tuple((key, json.dumps(value)) for key, value in sorted(design.sets.items()))
    return _numbers(design.base, sets, whole=whole)


@functools.cache
def _numbers(base: str, sets: tuple[tuple[str, str], ...], *, whole: bool) -> str:
    design, answers = Design(base, {key: json.loads(value) for key, value in sets}), Answers(NOWHERE)
    try:
        if not whole:
            settled = answers.settled(design)
            return json.dumps([settled["curves"], settled["poses"]]) if "curves" in settled else ""
        *walked, run = answers.run(design, silent)
    except SimulationError as error:
        return str(error)
    texts = [run["lead"], *(answer["text"] for answer in run["verdict"])]
    return json.dumps([[each["curves"] for each in walked], texts, run["results"]])


def moves(walk: Design, key: str) -> Iterator[Design]:
    """The design with a control at other places, near ones first; none that is refused."""
    listed = {control["key"]: control for control in controls(walk)}
    state = Answers(NOWHERE).state(walk)
    places: list[Any]
    if key in listed and listed[key]["choices"]:
        places = [name for name, _ in listed[key]["choices"] if name != listed[key]["value"]]
    elif key in listed:
        low, high, step = (listed[key][part] for part in ("low", "high", "step"))
        value = low if listed[key]["value"] is None else listed[key]["value"]
        near = [value + sign * max(step, round(0.1 * (high - low) / step) * step) for sign in (1, -1)]
        places = [place for place in (*near, low, high) if low <= place <= high and place != value]
    elif key in state["timing"]:
        times, length = state["timing"][key], state["period"] or 1.0
        places = [[[0.3 * length, 0.6 * length]], [[0.8 * length, 0.95 * length]]]
        places += [[[begin, end - 0.1 * length]] for begin, end in times]
    else:
        anchor = next(a for a in state["anchors"].values() if key.startswith(a["key"]))
        places = [anchor["x" if key.endswith("[0]") else "z"] + by for by in (20.0, -20.0)]
    for place in places:
        with contextlib.suppress(InputError):
            yield walk.changed({key: read(key, place)})


def every(walk: Design) -> list[str]:
    """The keys of all that is changed on the page by the mouse."""
    state = Answers(NOWHERE).state(walk)
    anchors = [f"{anchor['key']}[{axis}]" for anchor in state["anchors"].values() for axis in (0, 2)]
    return [*(control["key"] for control in state["controls"]), *state["timing"], *anchors]


def reason(walk: Design, key: str) -> str:
    """Why a control is out of use, as the page shows it; "" of one that is in use."""
    reasons, groups = idle(walk), {control["key"]: control["group"] for control in controls(walk)}
    group = groups.get(key, "timing" if key.startswith(("phases.", "timer.")) else "device")
    return reasons.get(group) or reasons.get(key, "")


@pytest.mark.slow
@pytest.mark.parametrize("walk", [*WALKS, OWN])
def test_what_can_be_moved_moves_a_number_and_what_moves_none_says_why(walk: str, own: str) -> None:
    design = start(walk, own)
    for key in sampled([key for key in every(design) if (walk, key) not in LOOSE], 5):
        why = reason(design, key)
        assert any(unlike(design, other) for other in moves(design, key)) is not bool(why), (key, why)


@pytest.mark.parametrize("walk", [*WALKS, OWN])
def test_every_walk_is_shown(walk: str, own: str) -> None:
    design, answers = start(walk, own) if walk == OWN else opened(walk).design, Answers(NOWHERE)
    state, settled = answers.state(design), answers.settled(design)
    if settled["kind"] == "unsettled":
        settled, _ = answers.run(design, silent)
    assert settled["kind"] == "settled" and len(settled["curves"]["toe"]) == 101
    assert len(state["controls"]) > 8
    found = {control["key"]: control for control in state["controls"]}
    mass = found["patient.body_mass"]  # of the recorded walker, where nobody states another
    assert mass["value"] == person_of(design.scenario).body_mass and mass["kind"] == "derived"
