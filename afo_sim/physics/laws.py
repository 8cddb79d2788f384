"""The registry LAWS of static force laws: name, kernel, native id, parameters, range, source."""

import math
from collections.abc import Callable, Mapping

from afo_sim.physics.braid_laws import (
    chou_hannaford_1996,
    martens_boblan_2017,
    tondu_lopez_2000,
    tondu_lopez_2000_bladder,
)
from afo_sim.physics.empirical_laws import (
    bolen_2026,
    kerscher_2006,
    maximum_force,
    polynomial,
    sarosi_2012,
    takosoglu_2016,
    three_element,
)
from afo_sim.physics.law import Braid, Law, LawParameter


def _martens(braid: Braid, q: Mapping[str, float]) -> tuple[float, ...]:
    shifted = Braid(braid.nominal_length, braid.nominal_radius, braid.braid_angle + q["angle_shift"])
    moduli = (q["c0"], q["c1"], q["c2"], q["c3"])
    return (
        braid.nominal_length,
        braid.nominal_radius,
        shifted.thread_length,
        shifted.turns,
        q["wall_thickness"],
        *moduli,
    )


def _bolen(braid: Braid, q: Mapping[str, float]) -> tuple[float, ...]:
    longest = q["f1"] * math.atan(q["f2"] * (braid.nominal_length - q["f3"]))
    return longest, q["contraction_620"], q["c0"], q["c1"], q["c2"]


_K = LawParameter("k", "k", "", 0.5, 3.0, "end correction; 1 is a cylinder", (0.8, 1.8), 1.0)
_WALL = LawParameter(
    "wall_thickness", "t", "m", 0.0, 5e-3, "thickness of braid and bladder", (0.0, 1e-3), 0.0
)
_BLADDER = (
    LawParameter(
        "bladder_force", "F0", "N", 0.0, 5000.0, "force taken by the bladder at κ = 0", (0.0, 200.0)
    ),
    LawParameter("bladder_stiffness", "K_b", "N", 0.0, 5e4, "bladder force per contraction", (0.0, 1000.0)),
)
_KERSCHER = (
    LawParameter("a_epsilon", "a_ε", "", 0.0, 500.0, "of ε(p) = a_ε e^(−p/bar) − b_ε", (1.0, 40.0)),
    LawParameter("b_epsilon", "b_ε", "", -10.0, 0.0, "of ε(p)", (-2.0, -0.8)),
    LawParameter("a_kappa", "a_κ", "", 0.0, 10.0, "of μ(κ) = a_κ e^(−c_κ κ) − b_κ", (0.02, 0.4)),
    LawParameter("b_kappa", "b_κ", "", -10.0, 0.0, "of μ(κ)", (-1.3, -0.6)),
    LawParameter("c_kappa", "c_κ", "", 0.1, 1000.0, "of μ(κ)", (20.0, 100.0)),
)
_MAXIMUM = (
    LawParameter(
        "maximum_pressure", "p_max", "Pa", 1e4, 2e6, "pressure that F_max belongs to", (6e5, 6e5), 6e5
    ),
    *(
        LawParameter(f"b{i}", f"b{i}", "N", -1e8, 1e8, f"of F_max, by κ^{i}", start)
        for i, start in enumerate(((500.0, 2000.0), (-6000.0, -3000.0), (0.0, 1e4), (-1e4, 0.0), (0.0, 1e4)))
    ),
    *(
        LawParameter(f"a{i}", f"a{i}", "N/Pa", -1.0, 1.0, f"of the slope by pressure, by κ^{i}", start)
        for i, start in enumerate(((5e-4, 3e-3), (-1e-3, 0.0), (-1e-3, 0.0)))
    ),
)
_SAROSI = (
    LawParameter("a1", "a1", "", -1000.0, 1000.0, "N/bar, before the exponential", (-15.0, 0.0)),
    LawParameter("a2", "a2", "", 0.0, 1e5, "N, before the exponential", (100.0, 400.0)),
    LawParameter("a3", "a3", "", -3.0, -1e-3, "1/%, exponent by contraction", (-0.4, -0.15)),
    LawParameter("a4", "a4", "", -1000.0, 0.0, "N/(%·bar)", (-12.0, -1.0)),
    LawParameter("a5", "a5", "", -1e4, 1e5, "N/bar", (50.0, 350.0)),
    LawParameter("a6", "a6", "", -1e5, 1e5, "N", (-350.0, -100.0)),
)
_POLYNOMIAL = tuple(
    LawParameter(
        f"a{i}{j}",
        f"a{i}{j}",
        "N",
        -1e7,
        1e7,
        f"by (10 κ)^{i} (p/6 bar)^{j}",
        {(0, 1): (500.0, 1500.0), (1, 0): (-1500.0, -500.0)}.get((i, j), (-30.0, 30.0)),
    )
    for i in range(6)
    for j in range(6 - i)
)
_A = LawParameter("a", "a", "", 0.0, 1000.0, "force at no contraction, over π r0² p", (10.0, 25.0))
_B = LawParameter("b", "b", "", 0.0, 1000.0, "force lost, over π r0² p", (5.0, 12.0))
_A0 = LawParameter("a0", "a0", "", 0.0, 1000.0, "of a(p) = a0 + a1/p", (10.0, 25.0))
_A1 = LawParameter("a1", "a1", "", -100.0, 100.0, "bar, of a(p) = a0 + a1/p", (-4.0, 0.0))
_N = LawParameter("n", "n", "", 0.1, 200.0, "exponent", (2.0, 10.0))
_N0 = LawParameter("n0", "n0", "", 0.0, 200.0, "of n(p) = n0 + n1/p", (0.0, 4.0))
_N1 = LawParameter("n1", "n1", "", 0.0, 200.0, "bar, of n(p) = n0 + n1/p", (0.0, 20.0))
_MARTENS = (
    LawParameter("angle_shift", "δ", "rad", -0.5, 0.5, "added to the braid angle", (-0.12, -0.02)),
    LawParameter("wall_thickness", "H0", "m", 0.0, 5e-3, "of the rubber", (1.8e-3, 1.8e-3), 1.8e-3),
    *(
        LawParameter(f"c{i}", f"c{i}", "", -1e12, 1e12, f"Pa/m^{i}, of the modulus, by L^{i}", start)
        for i, start in enumerate(((1e6, 1e7), (-1e7, 0.0), (0.0, 1e7), (-1e7, 0.0)))
    ),
)
_BOLEN = (
    LawParameter("c0", "c0", "", 0.0, 10.0, "force lost by contraction, over F620", (0.1, 0.6)),
    LawParameter("c1", "c1", "", 0.0, 100.0, "rate of that loss", (3.0, 11.0)),
    LawParameter("c2", "c2", "", 0.0, 20.0, "of the pressure's force", (0.4, 2.2)),
    LawParameter(
        "contraction_620", "κ620", "", 0.05, 0.5, "contraction at 620 kPa, unloaded", (0.2, 0.3), 0.25
    ),
    LawParameter("f1", "f1", "N", 0.0, 1e5, "of F620 = f1 atan(f2 (L0 − f3))", (200.0, 1500.0)),
    LawParameter("f2", "f2", "m^-1", 0.1, 1e4, "of F620", (15.0, 19.0), 17.0),
    LawParameter("f3", "f3", "m", 0.0, 0.1, "of F620", (0.01, 0.013), 0.01),
)
_LINES = (
    LawParameter("f0", "f0", "N", -1e4, 1e4, "of F_ce = f0 + f1 p", (-200.0, 200.0)),
    LawParameter("f1", "f1", "N/Pa", 0.0, 1.0, "of F_ce", (1e-3, 3e-3)),
    LawParameter("k0", "k0", "N/m", -1e6, 1e6, "of K = k0 + k1 p", (2000.0, 8000.0)),
    LawParameter("k1", "k1", "N/(m*Pa)", -1.0, 1.0, "of K", (0.01, 0.04)),
)
_SECOND_LINES = (
    LawParameter("switch_pressure", "p_s", "Pa", 1e4, 2e6, "where K changes", (3e5, 3e5), 314e3),
    LawParameter("k2", "k2", "N/m", -1e6, 1e6, "of K = k2 + k3 p above p_s", (2000.0, 8000.0)),
    LawParameter("k3", "k3", "N/(m*Pa)", -1.0, 1.0, "of K above p_s", (0.01, 0.04)),
)


def _radial(*names: str) -> Callable[[Braid, Mapping[str, float]], tuple[float, ...]]:
    return lambda braid, q: (braid.nominal_radius, braid.b, *(q[name] for name in names))


def _takosoglu(a0: str, a1: str | None, n0: str, n1: str | None) -> Callable[..., tuple[float, ...]]:
    return lambda braid, q: (
        braid.nominal_radius,
        q[a0],
        q[a1] if a1 else 0.0,
        q["b"],
        q[n0],
        q[n1] if n1 else 0.0,
    )


def _names(parameters: tuple[LawParameter, ...]) -> tuple[str, ...]:
    """What is fitted of parameters: those without a default."""
    return tuple(p.name for p in parameters if p.default is None)


def _plain(parameters: tuple[LawParameter, ...]) -> Callable[..., tuple[float, ...]]:
    return lambda braid, q: tuple(q[p.name] for p in parameters)


FESTO = (1e5, 6e5)  # pressures of the maker's characteristics that most laws were shown on [Pa]
_DERIVED = "p-dependence derived here; S3's own is lost from its text"

LAWS = {
    law.name: law
    for law in (
        Law(
            "chou_hannaford_1996",
            chou_hannaford_1996,
            0,
            (_WALL,),
            lambda braid, q: (braid.nominal_length, braid.thread_length, braid.turns, q["wall_thickness"]),
            ("braid_angle",),
            "p (3 L² − B²)/(4 π n²) + π p [D90 t (2 sin α − 1/sin α) − t²]",
            (1e5, 8e5),
            (0.0, 0.4),
            "no bladder; poor below about 1 bar",
            "Chou & Hannaford 1996; S1 eq. 1",
        ),
        Law(
            "tondu_lopez_2000",
            tondu_lopez_2000,
            1,
            (_K,),
            _radial("k"),
            ("braid_angle", "k"),
            "π r0² p [a (1 − k κ)² − b]",
            (1e5, 8e5),
            (0.0, 0.4),
            "force proportional to pressure; no bladder",
            "Tondu & Lopez 2000; S1",
        ),
        Law(
            "tondu_lopez_2000_bladder",
            tondu_lopez_2000_bladder,
            2,
            (_K, *_BLADDER),
            _radial("k", "bladder_force", "bladder_stiffness"),
            ("braid_angle", "bladder_force", "bladder_stiffness"),
            "π r0² p [a (1 − k κ)² − b] − F0 − K_b κ",
            (1e5, 8e5),
            (0.0, 0.4),
            "hand-made muscle with a rubber bladder",
            "Tondu & Lopez 2000, bladder terms derived here",
        ),
        Law(
            "kerscher_2006",
            kerscher_2006,
            3,
            _KERSCHER,
            _radial(*(p.name for p in _KERSCHER)),
            _names(_KERSCHER),
            "μ(κ) π r0² p [a (1 − ε(p) κ)² − b]",
            FESTO,
            (0.0, 0.25),
            "fluidic muscle; c_κ is hardly identifiable",
            "Kerscher et al. 2006; S2 eq. 3–7",
        ),
        Law(
            "maximum_force",
            maximum_force,
            4,
            _MAXIMUM,
            _plain(_MAXIMUM),
            _names(_MAXIMUM),
            "F_max(κ) − (p_max − p) (a0 + a1 κ + a2 κ²)",
            FESTO,
            (0.0, 0.25),
            "one muscle; the slope's form is derived here, the paper's is not recoverable",
            "Piteľ & Tóthová 2016, S2 eq. 8–9",
        ),
        Law(
            "sarosi_2012",
            sarosi_2012,
            5,
            _SAROSI,
            _plain(_SAROSI),
            _names(_SAROSI),
            "(a1 p + a2) e^(a3 κ) + a4 κ p + a5 p + a6",
            FESTO,
            (0.0, 0.25),
            "one muscle: its numbers do not transfer to another length",
            "Sárosi 2012; S2 eq. 10",
        ),
        Law(
            "polynomial",
            polynomial,
            6,
            _POLYNOMIAL,
            _plain(_POLYNOMIAL),
            _names(_POLYNOMIAL),
            "Σ a_ij (10 κ)^i (p/6 bar)^j, i + j ≤ 5",
            FESTO,
            (0.0, 0.25),
            "one muscle, nowhere beyond its measured range; 21 coefficients want many points",
            "Piteľ & Tóthová 2016, S2 eq. 11",
        ),
        Law(
            "takosoglu_2016",
            takosoglu_2016,
            7,
            (_A, _B, _N),
            _takosoglu("a", None, "n", None),
            ("a", "b", "n"),
            "π r0² p [a (1 − κ)^n − b]",
            FESTO,
            (0.0, 0.25),
            "fluidic muscle near one pressure",
            "Takosoglu et al. 2016, S3 eq. 5",
        ),
        Law(
            "takosoglu_2016_n",
            takosoglu_2016,
            7,
            (_A, _B, _N0, _N1),
            _takosoglu("a", None, "n0", "n1"),
            ("a", "b", "n0", "n1"),
            "π r0² p [a (1 − κ)^n(p) − b], n = n0 + n1/p",
            FESTO,
            (0.0, 0.25),
            f"fluidic muscle; {_DERIVED}",
            "Takosoglu et al. 2016, S3 eq. 6–7",
        ),
        Law(
            "takosoglu_2016_an",
            takosoglu_2016,
            7,
            (_A0, _A1, _B, _N0, _N1),
            _takosoglu("a0", "a1", "n0", "n1"),
            ("a0", "a1", "b", "n0", "n1"),
            "π r0² p [a(p) (1 − κ)^n(p) − b], a = a0 + a1/p, n = n0 + n1/p",
            FESTO,
            (0.0, 0.25),
            f"fluidic muscle; {_DERIVED}",
            "Takosoglu et al. 2016, S3 eq. 8–9",
        ),
        Law(
            "martens_boblan_2017",
            martens_boblan_2017,
            8,
            _MARTENS,
            _martens,
            _names(_MARTENS),
            "p (3 L² − B²)/(4 π n²) + σ_D H0 π L dD/dL − σ_L H0 π D",
            FESTO,
            (0.0, 0.25),
            "one length of fluidic muscle: its modulus is a cubic in length",
            "Martens & Boblan 2017",
        ),
        Law(
            "bolen_2026",
            bolen_2026,
            9,
            _BOLEN,
            _bolen,
            _names(_BOLEN),
            "F620(L0) [c0 (e^(−c1 ε) − 1) + P e^(−c2 ε²)], ε = κ/κ620, P = p/620 kPa",
            (0.0, 6.2e5),
            (0.0, 0.28),
            "fluidic muscles of 10 mm (11–52 cm) and 20 mm (30–51 cm)",
            "Bolen et al. 2026",
        ),
        Law(
            "reynolds_2003",
            three_element,
            10,
            _LINES,
            lambda braid, q: (
                braid.nominal_length,
                q["f0"],
                q["f1"],
                0.0,
                q["k0"],
                q["k1"],
                q["k0"],
                q["k1"],
            ),
            ("f0", "f1", "k0", "k1"),
            "F_ce(p) − K(p) x, F_ce = f0 + f1 p, K = k0 + k1 p, x = κ L0",
            (206.8e3, 620.5e3),
            (0.0, 0.25),
            "one muscle; its length is not given",
            "Reynolds et al. 2003; S0",
        ),
        Law(
            "serres_2009",
            three_element,
            10,
            (*_LINES, *_SECOND_LINES),
            lambda braid, q: (
                braid.nominal_length,
                q["f0"],
                q["f1"],
                q["switch_pressure"],
                q["k0"],
                q["k1"],
                q["k2"],
                q["k3"],
            ),
            ("f0", "f1", "k0", "k1", "k2", "k3"),
            "F_ce(p) − K(p) x, K with one kink",
            (150e3, 550e3),
            (0.0, 0.25),
            "one muscle; its make and length are not in the abstract",
            "Serres et al. 2009",
        ),
    )
}
