"""Hand-made braids from bore, angle and length: the geometry's closed forms, what is refused, first runs."""

import math
import pathlib
import re
from typing import Any

import numpy as np
import pytest
from command import call

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import BraidFacts, load
from afo_sim.description.handmade import blocked_force, maximum_contraction
from afo_sim.description.new import new

GIVEN = {"bore": "10 mm", "braid_angle": "22 deg", "length": "20 cm"}
IDEAL = "chou_hannaford_1996"  # an upper bound; the law in use takes off a bladder
R0, LENGTH, P = 5e-3, 0.18, 4e5  # of the braid between two ends of a bore each


@pytest.mark.parametrize("degrees", [10.0, 22.0, 35.0, 48.0])
def test_law_meets_the_closed_forms_of_the_braid(degrees: float, tmp_path: pathlib.Path) -> None:
    """F(0) = π r0² p (3/tan²α0 − 1/sin²α0); F = 0 at cos α = 1/√3; the threads lock at cos α = 1."""
    file = new("muscle", "mine", tmp_path, braid=GIVEN | {"braid_angle": f"{degrees} deg"})
    muscle = load("muscle", file).using(law=IDEAL)
    alpha = math.radians(degrees)
    assert muscle.nominal_length == pytest.approx(LENGTH)
    expected = math.pi * R0**2 * P * (3.0 / math.tan(alpha) ** 2 - 1.0 / math.sin(alpha) ** 2)
    assert muscle.force(P, contraction=0.0) == pytest.approx(expected, rel=1e-9)
    assert blocked_force(muscle.braid, P) == pytest.approx(expected, rel=1e-12)
    most = maximum_contraction(alpha)
    assert math.cos(alpha) * (1.0 - most) == pytest.approx(1.0 / math.sqrt(3.0), rel=1e-12)
    assert muscle.contraction(P, force=0.0) == pytest.approx(most, abs=1e-6)
    assert math.cos(alpha) * (1.0 - muscle.braid.lock) == pytest.approx(1.0, rel=1e-12)
    assert muscle.braid.lock < muscle.limits.contraction_min < 0.0
    assert muscle.limits.force == pytest.approx(expected, rel=1e-3)
    assert muscle.limits.contraction_max == pytest.approx(most, abs=1e-4)


def test_force_is_the_work_of_the_volume() -> None:
    """Without friction and with threads that do not stretch, F dL = −p dV."""
    muscle = load("muscle", "handmade_10mm").using(law=IDEAL)
    for kappa in (0.02, 0.1, 0.25, 0.35):
        h = 1e-5
        grown = muscle.volume(contraction=kappa + h) - muscle.volume(contraction=kappa - h)
        work = P * grown / (2.0 * h * LENGTH)
        assert muscle.force(P, contraction=kappa) == pytest.approx(work, rel=1e-6)


def test_facts_of_one_filling() -> None:
    """Volumes of two cylinders with the threads' length; isothermal air from ambient to 4 bar gauge."""
    facts = BraidFacts.of(load("muscle", "handmade_10mm"))
    alpha, neutral = math.radians(22.0), math.acos(1.0 / math.sqrt(3.0))
    thread = LENGTH / math.cos(alpha)

    def cylinder(angle: float) -> float:
        radius = R0 * math.sin(angle) / math.sin(alpha)
        return math.pi * radius**2 * thread * math.cos(angle) + 1.57e-6

    assert facts.volume == pytest.approx((cylinder(alpha), cylinder(neutral)), rel=1e-9)
    mass = (501_325.0 * cylinder(neutral) - 101_325.0 * cylinder(alpha)) / (287.05 * 293.15)
    assert facts.free_air == pytest.approx(mass / 1.185, rel=1e-9)


def test_a_wall_is_a_rubber_tube_that_counts_once(tmp_path: pathlib.Path) -> None:
    """Of 1 MPa where the user says nothing; it takes air from all laws, and force from those without rubber.

    At a contraction ratio of 10 %: λ = 0.9, h² = b − (b − 1) λ², T = A E/3 dW/dλ.
    """
    thick = load("muscle", new("muscle", "thick", tmp_path, braid=GIVEN | {"wall_thickness": "1 mm"}))
    thin = load("muscle", "handmade_10mm")
    assert thick.tube is not None and thick.tube.modulus == 1e6 and thick.tube.wall_thickness == 1e-3
    told = thick.tube.provenance
    assert told["modulus"].kind == "assumed" and told["wall_thickness"].kind == "user"
    area, b, x = math.pi * (R0**2 - 4e-3**2), 1.0 / math.sin(math.radians(22.0)) ** 2, 0.9
    h2 = b - (b - 1.0) * x**2
    taken = area * 1e6 / 3.0 * (x - (b - 1.0) * x - (1.0 / x - (b - 1.0) * x / h2) / (x**2 * h2))
    for law in ("tondu_lopez_2000", IDEAL):
        forces = [each.using(law=law).force(P, contraction=0.1) for each in (thick, thin)]
        assert forces[0] - forces[1] == pytest.approx(taken, rel=1e-6)
    assert thick.force(P, contraction=0.1) == thin.force(P, contraction=0.1)  # its law has a bladder
    for kappa in (0.0, 0.2):
        less = thin.volume(contraction=kappa) - thick.volume(contraction=kappa)
        assert less == pytest.approx(area * LENGTH, rel=1e-9)


def test_wall_term_of_the_law_alone() -> None:
    """Chou & Hannaford's, of a wall that keeps its thickness: at κ = 0 π p [D90 t (2 s − 1/s) − t²]."""
    walls = ({}, {"laws.chou_hannaford_1996.wall_thickness": "1 mm"})
    thin, thick = (load("muscle", "handmade_10mm", {"law": IDEAL} | wall) for wall in walls)
    s = math.sin(math.radians(22.0))
    term = math.pi * P * (2.0 * R0 / s * 1e-3 * (2.0 * s - 1.0 / s) - 1e-6)
    assert term < 0.0
    loss = thick.force(P, contraction=0.0) - thin.force(P, contraction=0.0)
    assert loss == pytest.approx(term, rel=1e-9)
    tube = {"tube": {"modulus": "1 MPa", "wall_thickness": "1 mm"}}
    with pytest.raises(InputError) as refused:
        load("muscle", "handmade_10mm", walls[1] | tube)
    assert refused.value.field == "laws.chou_hannaford_1996.wall_thickness"


def test_bladder_of_s1s_bore_and_angle_is_s1s(tmp_path: pathlib.Path) -> None:
    given = {"bore": "11.5 mm", "braid_angle": "22 deg", "length": "21.5 cm", "end_length": "5.19 cm"}
    own = load("muscle", new("muscle", "mine", tmp_path, braid=given)).laws["tondu_lopez_2000_bladder"]
    shipped = load("muscle", "s1_215mm").law_set.parameters
    for name in ("bladder_force", "bladder_stiffness"):
        assert own.parameters[name] == pytest.approx(shipped[name], rel=1e-3)


def test_every_number_says_whether_it_is_yours(tmp_path: pathlib.Path) -> None:
    muscle = load("muscle", new("muscle", "mine", tmp_path, braid=GIVEN))
    kinds = {name: told.kind for name, told in muscle.provenance.items()}
    assert {name for name, kind in kinds.items() if kind == "user"} == {"total_length", "bore", "braid_angle"}
    parts = [muscle, muscle.limits, *muscle.laws.values(), *muscle.frictions.values()]
    found = {told.kind for part in parts for told in part.provenance.values()}
    assert found == {"user", "assumed", "derived"}


def test_shipped_template_is_what_the_template_writes(tmp_path: pathlib.Path) -> None:
    own = load("muscle", new("muscle", "mine", tmp_path, braid=GIVEN)).model_dump()
    shipped = load("muscle", "handmade_10mm").model_dump()
    different = {key for key in own if own[key] != shipped[key]}
    assert different <= {"name", "description", "provenance", "laws"}
    assert _parameters(own) == _parameters(shipped)


def _parameters(table: dict[str, Any]) -> Any:
    return {name: {k: v for k, v in law.items() if k != "provenance"} for name, law in table["laws"].items()}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"bore": "0 mm"}, r"bore = '0 mm': is out of range; allowed: above 0 mm, to 200 mm"),
        ({"bore": "-5 mm"}, r"bore .* is out of range"),
        ({"bore": "3 bar"}, r"bore = '3 bar'"),
        ({"braid_angle": "54.8 deg"}, r"54\.7 deg or more does not shorten .*; allowed: 5 deg"),
        ({"braid_angle": "52 deg"}, r"braid_angle .* out of range; allowed: 5 deg to 49\.9 deg"),
        ({"braid_angle": "2 deg"}, r"braid_angle .* out of range"),
        ({"braid_angle": "22"}, r"has no unit"),
        ({"length": "-3 cm"}, r"length .* out of range"),
        ({"length": "2 cm"}, r"no braid is left between the ends, 20 mm in all; allowed: more than 30 mm"),
        ({"length": "2.5 cm"}, r"leaves 5 mm of braid, no longer than the bore of 10 mm"),
        ({"bore": "9 cm"}, r"leaves 20 mm of braid, no longer than the bore of 90 mm"),
        ({"bore": "80 mm", "length": "60 cm"}, r"would pull with 22\.6 kN at 4 bar.*allowed: up to 15 kN"),
        ({"end_length": "30 cm"}, r"no braid is left between the ends, 300 mm in all"),
        ({"wall_thickness": "1 cm"}, r"wall_thickness .* allowed: 0\.1 mm to 5 mm"),
        ({"wall_thickness": "5 mm"}, r"wall_thickness .* leaves no air in the bore; allowed: less than 5 mm"),
        ({"bor": "1 cm"}, r"bor: is unknown; .* did you mean 'bore'"),
    ],
)
def test_bad_braids_are_refused_and_leave_nothing(
    change: dict[str, str], says: str, tmp_path: pathlib.Path
) -> None:
    with pytest.raises(InputError, match=says):
        new("muscle", "mine", tmp_path, braid=GIVEN | change)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", GIVEN)
def test_a_braid_needs_all_three(missing: str, tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=f"{missing}: is missing; .*a braid needs `bore`"):
        new("muscle", "mine", tmp_path, braid={k: v for k, v in GIVEN.items() if k != missing})


@pytest.mark.parametrize(
    ("degrees", "bore"), [(5.1, 1.0), (49.8, 1.0), (22.0, 60.0), (30.0, 3.0), (49.0, 190.0)]
)
def test_extreme_braids_load(degrees: float, bore: float, tmp_path: pathlib.Path) -> None:
    """Whatever the template accepts, the description accepts too."""
    braid = {"bore": f"{bore} mm", "braid_angle": f"{degrees} deg", "length": "60 cm"}
    muscle = load("muscle", new("muscle", "mine", tmp_path, braid=braid))
    for law in muscle.laws:
        assert np.isfinite(muscle.using(law=law).force("4 bar", contraction=[0.0, 0.1])).all()


# --- the command, and first runs


def test_command_writes_tells_and_runs(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    braid = ("--bore", "10 mm", "--braid-angle", "22 deg", "--length", "20 cm")
    code, printed, complaint = call(capsys, "new", "muscle", "mine", *braid)
    assert code == 0, complaint
    assert "contraction at most: 37.7 %" in printed and "353.5 N" in printed and "l (ANR)" in printed
    # 353.5 N less a bladder like S1's, 102.8 N; what each law gives beside the one in use
    assert re.search(r"bladder at 4 bar: 250\.7 N \(in use\), contraction at most 21\.9 %", printed)
    assert re.search(
        r"chou_hannaford_1996 at 4 bar: 353\.5 N \(\+41 %\), contraction at most 37\.7 %", printed
    )
    sets = {"orthosis.muscle.dorsiflexor.type": "mine", "orthosis.muscle.dorsiflexor.link_length": "12 cm"}
    run = afo.run("seated", sets | {"duration": "3 s"})
    assert run.ok and run["muscle/dorsiflexor_1/force"].max() > 10.0
    code, _, complaint = call(
        capsys, "new", "muscle", "bad", *braid[:2], "--braid-angle", "60 deg", *braid[4:]
    )
    assert code != 0 and "--braid-angle = '60 deg'" in complaint
    for arguments, says in (
        (("valve", "v", "--bore", "3 mm"), "does not go with a new valve"),
        (("muscle", "v", "--like", "dmsp_10", *braid), "does not go with --like"),
    ):
        code, _, complaint = call(capsys, "new", *arguments)
        assert code != 0 and says in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


@pytest.mark.slow
def test_a_walk_by_the_upper_bound_names_what_the_other_law_gives() -> None:
    """By the ideal braid alone the toe would be judged GOOD."""
    sets = {
        "orthosis.muscle.dorsiflexor.type": "handmade_10mm",
        "duration": "3 s",
        "supply.pressure": "3 bar",
    }
    sets |= {"orthosis.muscle.dorsiflexor.link_length": "12.6 cm"}
    scenario = load("scenario", "walk-dropfoot-afo", sets)
    bladder = afo.run(scenario)
    ideal = afo.run(scenario.set({"orthosis.muscle.dorsiflexor.type.law": IDEAL}))
    assert ideal.metrics["toe_clearance"] > "10 mm" > bladder.metrics["toe_clearance"]
    assert ideal.metrics["toe_clearance_by_other_laws"] == bladder.metrics["toe_clearance"]
    assert {answer.name: answer.status for answer in ideal.verdict}["lift"] == "doubtful"
