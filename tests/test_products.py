"""Every folder under models/ is a product: it loads, steps a second, warns of nothing unexpected."""

import pathlib

import pytest

import afo_sim
from afo_sim.common import assets
from afo_sim.description import load

MODELS = assets.folder("models")
KINDS = ("leg", "orthosis", "muscle", "valve", "tube", "source", "regulator", "shoe")


@pytest.mark.parametrize("kind", KINDS)
def test_every_description_loads_and_says_what_it_is(kind: str) -> None:
    found = assets.names(kind)
    assert found
    for name in found:
        description = load(kind, name)
        assert description.name == name
        assert len(description.description) > 10


@pytest.mark.parametrize("name", assets.names("scenario"))
def test_every_scenario_runs_a_second(name: str) -> None:
    run = afo_sim.run(name, {"duration": "1 s"})
    assert run.ok
    # a second of walking is less than a stride, and sees little of how a timer drifts against the gait; the
    # shipped cuff presses beyond discomfort in it; short links hold the toe up, and no height is the lowest;
    # empty plantarflexors with slack are filled in several strides; held positions have no cycle
    told = (
        "extrapolated",
        "no whole stride",
        "the timer drifts",
        "cuff: it must press",
        "have no minimum",
        "plantarflexor_1 never pulls",
        "plantarflexor_2 never pulls",
        "no cycle is described",
    )
    assert [w for w in run.warnings if not any(known in w for known in told)] == []


@pytest.mark.parametrize("name", assets.names("muscle"))
def test_every_number_of_a_muscle_says_where_it_comes_from(name: str) -> None:
    muscle = load("muscle", name)
    words = {
        "name",
        "description",
        "law",
        "limits",
        "provenance",
        "laws",
        "friction",
        "frictions",
        "damper",
        "tube",
    }
    numbers = set(type(muscle).model_fields) - words - {"grade", "covariance", "lengths", "pieces"}
    own = {"free_contraction", "blocked_force", "test_pressure"}  # of a muscle that was measured itself
    own |= {"force_factor", "contraction_factor", "end_loss"}  # by which it differs
    assert numbers - (own - muscle.model_fields_set) == set(muscle.provenance)
    for told in (*muscle.laws.values(), *muscle.frictions.values()):
        assert set(told.parameters) - set(told.provenance) == set()
    if muscle.damper is not None:
        assert muscle.damper.model_fields_set - {"provenance"} == set(muscle.damper.provenance)
    for told in filter(None, (muscle.limits, muscle.tube)):
        assert set(told.provenance) == set(type(told).model_fields) - {"provenance"}
    for told in filter(None, (muscle.lengths, muscle.lengths and muscle.lengths.force)):
        assert set(told.provenance) == set(type(told).model_fields) - {"provenance", "force"}
    assert (MODELS / "muscles" / name / "README.md").is_file()


@pytest.mark.parametrize("name", assets.names("shoe"))
def test_every_number_of_a_shoe_says_where_it_comes_from(name: str) -> None:
    shoe = load("shoe", name)
    assert set(shoe.provenance) == set(type(shoe).model_fields) - {"name", "description", "provenance"}
    assert not [told for told in shoe.provenance.values() if told.kind == "published"]  # none was measured
    assert (MODELS / "shoes" / name / "README.md").is_file()


def test_fitted_numbers_are_never_called_published() -> None:
    muscle = load("muscle", "s1_215mm")
    provenance = muscle.provenance | muscle.law_set.provenance
    for name in (
        "end_length",
        "braid_angle",
        "bladder_force",
        "bladder_stiffness",
    ):
        assert provenance[name].kind == "fitted"
        assert (
            "not separately identifiable" in provenance[name].source
            or "correlation" in provenance[name].source
        )


def test_short_muscle_fits_too() -> None:
    """The 12 cm muscle in the same frame, with a longer link: it lifts less."""
    short = afo_sim.run(
        "seated",
        {
            "duration": "4 s",
            "orthosis.muscle.dorsiflexor.type": "s1_120mm",
            "orthosis.muscle.dorsiflexor.link_length": "20.7 cm",
            "orthosis.range_of_motion": ["-10 deg", "20 deg"],
        },
    )
    long = afo_sim.run("seated", {"duration": "4 s"})
    assert 1.0 < short.metrics["range_of_motion"].value < long.metrics["range_of_motion"].value - 3.0


def test_own_orthosis_beside_own_scenario(tmp_path: pathlib.Path) -> None:
    """Paths are taken from the file that names them."""
    source = MODELS / "orthoses" / "s1"
    for name in ("cuff.xml", "plate.xml"):
        (tmp_path / name).write_text((source / name).read_text())
    text = (source / "orthosis.toml").read_text()
    (tmp_path / "orthosis.toml").write_text(text.replace("count = 3", "count = 1"))
    scenario = (MODELS / "scenarios" / "seated.toml").read_text()
    (tmp_path / "mine.toml").write_text(scenario.replace('orthosis = "s1"', 'orthosis = "orthosis.toml"'))
    run = afo_sim.run(str(tmp_path / "mine.toml"), {"duration": "1 s"})
    assert run.ok
    assert "muscle/dorsiflexor_1/force" in run.columns
    assert "muscle/dorsiflexor_2/force" not in run.columns
