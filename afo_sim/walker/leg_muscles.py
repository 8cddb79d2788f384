"""Segments, muscles and muscle paths of the walker's body, of an adult of 75 kg and 1.75 m."""

from dataclasses import dataclass

SIGMA, DENSITY = 0.25e6, 1059.7  # specific tension [Pa], density [kg/m³] of muscle


@dataclass(frozen=True)
class Segment:
    """mass [kg]; centre of mass and end from its origin (x forward, y left, z up) [m]; inertia [kg·m²]."""

    # Source: Thigh: SCONE's H0914v3 (Geijtenbeek 2019, doi 10.21105/joss.01421), after Delp et al. 1990. The
    # trunk is its pelvis and torso as one, with 1.2 kg more so that the body has 75 kg (derived).
    mass: float
    centre: tuple[float, float, float]
    inertia: float
    end: tuple[float, float, float] = (0.0, 0.0, 0.0)


# Pelvis 11.777 kg at its origin with 0.0579 kg·m², torso 34.2366 + 1.226 kg at (−0.06, 0.4015) with 1.4825.
_PELVIS, _TORSO = 11.777, 35.4626
_SHARE = _TORSO / (_PELVIS + _TORSO)
TRUNK = Segment(
    _PELVIS + _TORSO,
    (-0.06 * _SHARE, 0.0, 0.4015 * _SHARE),
    0.0579 + 1.4825 + _PELVIS * _SHARE * (0.06**2 + 0.4015**2),
)
THIGH = Segment(9.3014, (0.0, 0.0, -0.170), 0.1412, (0.0, 0.0, -0.396))


@dataclass(frozen=True)
class Muscle:
    """A muscle of a leg.

    Source: SCONE's H0914v3; slow fibres: Song & Geyer 2015 (doi 10.1113/JP270228); tendon strain and
    damping: Millard et al. 2013, doi 10.1115/1.4023390.
    """

    force: float  # [N]
    optimal: float  # length of the fibre [m]
    slack: float  # length of the tendon [m]
    pennation: float  # at the optimal length [rad]
    slow: float = 0.5  # share of slow fibres [-]
    passive: float = 1.0  # factor at rest [-]; 0 at the ankle, whose moment is the joint's
    fastest: float = 10.0  # [1/s]
    damping: float = 0.1  # of the fibre [-]
    tendon_strain: float = 0.049  # at the greatest force [-]

    @property
    def mass(self) -> float:
        """F/σ · l_o · ρ [kg]."""
        return self.force / SIGMA * self.optimal * DENSITY


MUSCLES = {
    "hamstrings": Muscle(2594.0, 0.0976, 0.319, 0.2025, slow=0.35),
    "glutei": Muscle(1944.0, 0.1569, 0.111, 0.3822, slow=0.52),
    "iliopsoas": Muscle(2186.0, 0.1066, 0.152, 0.2496, slow=0.49),
    "vasti": Muscle(4530.0, 0.0993, 0.1231, 0.0785, slow=0.44),
    "gastrocnemius": Muscle(2241.0, 0.051, 0.384, 0.1728, slow=0.51, passive=0.0),
    "soleus": Muscle(3549.0, 0.044, 0.248, 0.4939, slow=0.89, passive=0.0),
    "tibialis": Muscle(1579.0, 0.0683, 0.243, 0.1676, slow=0.73, passive=0.0),
}

# Points of each path: segment, then x forward, y left, z up from hip (thigh), ankle (shank, foot) or the
# trunk's origin [m], of the right leg. H0914v3's, its bodies' origins moved to those joints.
PATHS: dict[str, tuple[tuple[str, float, float, float], ...]] = {
    "hamstrings": (
        ("trunk", -0.05526, -0.06944, -0.10257),
        ("shank", -0.028, -0.11293, 0.4100),
        ("shank", -0.021, -0.1178, 0.3900),
    ),
    "glutei": (
        ("trunk", -0.0642, -0.0563, 0.0176),
        ("trunk", -0.0669, -0.0914, -0.0520),
        ("thigh", -0.0426, -0.0293, -0.0530),
        ("thigh", -0.0156, -0.0419, -0.1016),
    ),
    "iliopsoas": (
        ("trunk", 0.006, -0.0289, 0.0887),
        ("trunk", 0.0407, -0.076, -0.0100),
        ("thigh", 0.033, -0.0038, -0.0350),
        ("thigh", -0.0188, -0.0104, -0.0597),
    ),
    "vasti": (
        ("thigh", 0.029, -0.031, -0.1924),
        ("thigh", 0.038, -0.007, -0.3400),
        ("shank", 0.038, -0.0018, 0.4550),
    ),
    "gastrocnemius": (("thigh", -0.020, 0.024, -0.3880), ("foot", -0.04377, 0.0132, -0.01095)),
    "soleus": (("shank", -0.0024, -0.0071, 0.2767), ("foot", -0.04377, 0.0132, -0.01095)),
    "tibialis": (
        ("shank", 0.0179, -0.0115, 0.2676),
        ("shank", 0.0329, 0.0177, 0.0349),
        ("foot", 0.06783, 0.0226, -0.02415),
    ),
}
