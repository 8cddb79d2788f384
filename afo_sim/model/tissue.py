"""The relaxed ankle of a person: its tissue's moment and its damping, at the person's size."""

from dataclasses import dataclass

from afo_sim.description.scenario import Scenario
from afo_sim.model.person import Size


@dataclass(frozen=True)
class Tissue:
    """scale of Riener & Edrich's healthy mean [-], offset of its zero [rad], damping [N·m·s/rad]."""

    scale: float
    offset: float
    damping: float


def healthy_tissue(scenario: Scenario) -> Tissue:
    """The leg's, at the person's size, without what the patient's ails."""
    leg, size = scenario.leg, Size.of(scenario)
    return Tissue(leg.passive.scale * size.springy, leg.passive.offset, leg.damping * size.damped)


def own_tissue(scenario: Scenario) -> Tissue:
    """The patient's own; where there is none, the leg's."""
    healthy, patient = healthy_tissue(scenario), scenario.patient
    if patient is None:
        return healthy
    scale = healthy.scale * patient.passive_scale
    return Tissue(scale, healthy.offset + patient.passive_offset, healthy.damping)


def reflex_gain(scenario: Scenario) -> float:
    """Gain of the spastic plantarflexors at the person's size [N·m·s/rad]."""
    assert scenario.patient is not None
    return scenario.patient.spasticity * Size.of(scenario).damped
