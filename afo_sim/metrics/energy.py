"""Energy balance of a run as metrics: where the work of the air goes."""

from collections.abc import Mapping

from afo_sim.metrics.metric import ENERGY, Metric, measured, tells

EACH = "per counted stride; of a fixed shank per cycle begun"


@tells(
    ENERGY,
    ("air_work", "J", "Work of the air on the muscles", EACH),
    ("skeleton_work", "J", "Work of the muscles on the skeleton", EACH),
    ("damper_loss", "J", "Lost in dampers", f"of muscles, cuff and plate; {EACH}"),
    ("friction_loss", "J", "Lost in friction", f"of the muscles; {EACH}"),
    ("wrap_loss", "J", "Lost at guides", f"friction at the paths' points and surfaces; {EACH}"),
    ("spring_change", "J", "Stored in springs", f"change in cables, cuff and plate; {EACH}"),
    ("bladder_change", "J", "Stored in bladders", f"change of what the muscles hold without air; {EACH}"),
    ("law_mismatch", "J", "Given by the laws alone", f"work beyond that of their air's volume; {EACH}"),
    (
        "energy_error",
        "percent",
        "Energy found nowhere",
        "of the air's work without its sign; of the run, or two settled strides",
    ),
)
def energy_metrics(terms: Mapping[str, float], number: int, error: float) -> dict[str, Metric]:
    """Metrics of an energy balance: air_work + law_mismatch is what is done, the other terms where it goes.

    Parameters
    ----------
    terms : works and changes of energy over all cycles or strides together [J], by metric
    number : of cycles or strides
    error : share of the air's work that is found nowhere [-]

    Returns
    -------
    dict of Metric by name
    """
    found = {name: measured(name, value / number) for name, value in terms.items()}
    return found | {"energy_error": measured("energy_error", 100.0 * error)}
