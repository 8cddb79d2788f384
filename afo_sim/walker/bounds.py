"""Bounds and signs of a gait's numbers: what a search tries, and a file holds."""

import numpy as np

from afo_sim.physics import GAINS
from afo_sim.walker.gait import OFFSETS, Vector

# Published (Geijtenbeek 2019, doi 10.21105/joss.01421): SCONE searches ControllerGH2010v12 within gains ±10,
# constants ±1, lengths and angles as here, and H0918RS2v3 within gains of length, of lean and of the trunk's
# rate from 0, and −2 to 0 of the soleus on the tibialis. Assumed: every other sign, which is that of Geyer &
# Herr's law, and what this project adds, which excites.
_SPANS = {
    (-0.5, 0.5): " ".join(OFFSETS),
    (0.001, 1.0): "load",
    (-1.0, 0.0): "knee_straight",
    (-2.0, 0.0): "tibialis_soleus",
    (0.3, 2.0): "tibialis_offset",  # published from 0.5 on; the fast gait has 0.303
    (0.5, 2.0): "soleus_offset gastrocnemius_offset",
    (0.0, 2.0): "iliopsoas_offset stretch_offset",
    (0.0, 10.0): "tibialis_length soleus_length gastrocnemius_length iliopsoas_length lean soleus_force "
    "gastrocnemius_force vasti_force hamstrings_force hamstrings_pitch hamstrings_rate glutei_force "
    "glutei_pitch glutei_rate",
    (-10.0, 0.0): "iliopsoas_pitch iliopsoas_rate stretch",
    (-1.0, 1.0): "hamstrings_start glutei_start iliopsoas_start iliopsoas_lift glutei_lift lean_offset "
    "tibialis_swing hamstrings_swing vasti_swing",
    (0.0, 1.0): "vasti_start soleus_start gastrocnemius_start tibialis_loading",
}  # fmt: skip
BOUNDS = {name: span for span, names in _SPANS.items() for name in names.split()}
LEAST, MOST = (
    Vector(np.array([BOUNDS[n][k] for n in OFFSETS]), np.array([[BOUNDS[n][k] for n in GAINS]] * 2))
    for k in (0, 1)
)
