"""Checks of a gait cycle: wrong units, signs, axes and gaps are refused in the file's own words."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn, get_args

import numpy as np

from afo_sim.common import InputError, Notice, refuse
from afo_sim.gait.cycle import COLUMNS, NUMBERS, OPTIONAL, GaitCycle, Walker
from afo_sim.gait.flat_foot import USUAL

_CLOSING_ANGLE = 10.0  # largest difference between the stride's two ends that is taken out [deg]; recorded
# strides of healthy and lame walkers differ by up to 6.4 (measured)
CLOSING_USUAL = 5.0  # from which on the difference is a warning [deg]
_CLOSING_HEIGHT = 0.03  # likewise of the ankle's height [m]
_MIN_ROWS = 50
STANCE_FORCE = 0.05  # vertical force that separates stance from swing [body weights]
COP_FORCE = 0.10  # above it the centre of pressure must be known [body weights]
LATE_SWING = 0.9  # force that rises beyond this phase is the next heel strike's [-]
_PEAK_FORCE = 0.5  # that some part of the stance must reach [body weights]
_MEAN_FORCE = (0.35, 0.65)  # over the stride, of one leg: half the body, more or less [body weights]
STANCE_SHARE = (0.35, 0.85)  # of the stride [-]
_STANCE_START = 0.05  # latest phase at which the force may begin to rise [-]
HEIGHT_ERROR = 0.02  # between the stated ankle height and the recorded one, foot flat [m]
_TRAVEL_ERROR = 0.25  # between the ankle's way and speed × time, as a share [-]
_SLIDE = 0.08  # of the ankle while the foot is flat; it rolls over by some 0.01 [m]
MOMENT_ERROR = 0.25  # RMS between moment and ground force's demand, as a share of its peak [-]
RANGES = {
    "stride_time_s": (0.4, 5.0),
    "body_mass_kg": (5.0, 300.0),
    "walking_speed_m_per_s": (0.05, 4.0),
    "ankle_height_m": (0.02, 0.2),
}
BODY_HEIGHT = (0.5, 2.5)  # of a person who walks; an optional key [m]
SOLE_THICKNESS = (0.0, 0.15)  # likewise, under the ankle [m]
_OPTIONAL_RANGES = {"body_height_m": BODY_HEIGHT, "sole_thickness_m": SOLE_THICKNESS}
# Column: (least, most, what the number probably is beyond them).
_LIMITS = {
    "shank_angle_deg": (-90.0, 120.0, "degrees converted twice, or another angle"),
    "knee_angle_deg": (-90.0, 160.0, "degrees converted twice, or another angle"),
    "ankle_angle_deg": (-80.0, 60.0, "degrees converted twice, or its zero elsewhere (90 deg?)"),
    "ankle_x_m": (-20.0, 20.0, "millimetres"),
    "ankle_z_m": (-0.1, 1.5, "millimetres"),
    "grf_x_bw": (-1.0, 1.0, "newtons"),
    "grf_z_bw": (-4.0, 4.0, "newtons, or of another body mass"),
    "cop_x_m": (-0.6, 0.6, "millimetres, or measured from another point than the ankle"),
    "ankle_moment_nm_per_kg": (-4.0, 4.0, "N·m, not divided by the body mass"),
}


def examine(cycle: GaitCycle, file: object = None) -> None:
    """Refuse a gait cycle that cannot be what it says."""
    _Examination(cycle, file).run()


@dataclass(frozen=True)
class _Examination:
    cycle: GaitCycle
    file: object

    def run(self) -> None:
        refuse(self._header())
        self._phase()
        empty = {column: ~np.isfinite(getattr(self.cycle, name)) for column, (name, _) in COLUMNS.items()}
        asked = "a number in each row"
        refuse(
            self._wrong(column, self._empty(bad), asked)
            for column, bad in empty.items()
            if column != "cop_x_m" and np.any(bad)
        )
        self._radians()
        self._axes()
        refuse(self._limits())
        self._pressure_gaps()
        self._stance()
        self._travel()
        self._period()
        self._angle_signs()
        self._height()
        phase, force = self.cycle.phase, self.cycle.grf_x
        end = stance(self.cycle)
        early, late = (force[(phase >= a * end) & (phase <= b * end)].mean() for a, b in ((0, 0.5), (0.5, 1)))
        if early > 0.02 and late < -0.02:
            seen = f"is {early:+.2g} in early and {late:+.2g} in late stance: wrong sign?"
            self._refuse("grf_x_bw", seen, "forward positive: braking (negative) first, then pushing off")
        self._moment()

    def _usual(self) -> np.ndarray:
        """Mask of the samples in which a foot usually lies flat, whatever the angles say (n,)."""
        phase = self.cycle.phase
        return np.asarray((phase >= USUAL[0]) & (phase <= USUAL[1]))

    def _refuse(self, column: str, seen: str, expected: str) -> NoReturn:
        raise self._wrong(column, seen, expected)

    def _wrong(self, column: str, seen: str, expected: str) -> InputError:
        return InputError(seen, file=self.file, field=column, allowed=expected)

    def _column(self, column: str) -> np.ndarray:
        """A column in the file's own unit and sign."""
        name, factor = COLUMNS[column]
        return np.asarray(getattr(self.cycle, name) / factor)

    def _header(self) -> Iterator[InputError]:
        cycle = self.cycle
        for key, choices in (("side", ("right", "left")), ("walker", (None, *get_args(Walker)))):
            if getattr(cycle, key) not in choices:
                problem, allowed = f"is not a valid {key}", ", ".join(filter(None, choices))
                value = getattr(cycle, key)
                yield InputError(problem, file=self.file, field=key, value=value, allowed=allowed)
        for key, (low, high) in {**RANGES, **_OPTIONAL_RANGES}.items():
            value = getattr(cycle, {**NUMBERS, **OPTIONAL}[key])
            if value is not None and not low <= value <= high:
                allowed, shown = f"{low:g} to {high:g}", f"{value:.4g}"
                yield InputError("is out of range", file=self.file, field=key, value=shown, allowed=allowed)

    def _phase(self) -> None:
        phase = self.cycle.phase
        if len(phase) < _MIN_ROWS:
            self._refuse("phase", f"has {len(phase)} rows", f"at least {_MIN_ROWS} rows over the stride")
        if not np.all(np.isfinite(phase)):
            self._refuse("phase", "has empty cells", "a number in each row")
        if np.any(np.diff(phase) <= 0.0):
            k = int(np.argmax(np.diff(phase) <= 0.0))
            seen = f"does not increase: {phase[k + 1]:g} follows {phase[k]:g}"
            self._refuse("phase", seen, "increasing from 0 to 1")
        if abs(phase[0]) > 1e-6 or abs(phase[-1] - 1.0) > 1e-6:
            seen = f"runs from {phase[0]:g} to {phase[-1]:g}"
            seen += " (percent?)" if 50.0 < phase[-1] <= 100.5 else ""
            self._refuse("phase", seen, "0 at heel strike to 1 at the next heel strike, both with a row")

    def _pressure_gaps(self) -> None:
        bad = ~np.isfinite(self.cycle.cop_x) & (self.cycle.grf_z > COP_FORCE)
        bad &= self.cycle.phase < LATE_SWING
        if np.any(bad):
            expected = f"a number wherever grf_z_bw is above {COP_FORCE:g} in stance"
            self._refuse("cop_x_m", self._empty(bad), expected)

    def _empty(self, bad: np.ndarray) -> str:
        where = self.cycle.phase[bad]
        return f"is empty in {bad.sum()} rows between phase {where[0]:.3g} and {where[-1]:.3g}"

    def _radians(self) -> None:
        for column in ("shank_angle_deg", "knee_angle_deg", "ankle_angle_deg"):
            values = self._column(column)
            if np.abs(values).max() < 2.5 and 0.2 < np.ptp(values) < 2.5:
                seen = f"goes from {values.min():.3g} to {values.max():.3g}, which looks like radians"
                self._refuse(column, seen, "degrees; a walking shank goes through some 60, a knee 50 to 70")

    def _axes(self) -> None:
        force_x, force_z = self._column("grf_x_bw"), self._column("grf_z_bw")
        peak_x, peak_z = np.abs(force_x).max(), np.abs(force_z).max()
        if peak_x > peak_z:
            seen = f"peaks at {peak_x:.3g} and grf_z_bw at {peak_z:.3g}: swapped axes?"
            self._refuse("grf_x_bw", seen, "x forward, some 0.2 body weights; z up, some 1.1")
        way_x, way_z = abs(np.ptp(self.cycle.ankle_x)), abs(np.ptp(self.cycle.ankle_z))
        end_z = abs(self.cycle.ankle_z[-1] - self.cycle.ankle_z[0])
        if end_z > _CLOSING_HEIGHT and end_z > abs(self.cycle.ankle_x[-1] - self.cycle.ankle_x[0]):
            seen = f"travels {way_z:.3g} m and ankle_x_m {way_x:.3g} m: swapped axes?"
            self._refuse("ankle_z_m", seen, "x forward, a stride's length; z up, returning after the stride")

    def _limits(self) -> Iterator[InputError]:
        for column, (low, high, guess) in _LIMITS.items():
            values = self._column(column)
            values = values[np.isfinite(values)]
            if len(values) and not (low <= values.min() and values.max() <= high):
                seen = f"goes from {values.min():.4g} to {values.max():.4g} (perhaps {guess})"
                yield self._wrong(column, seen, f"{low:g} to {high:g}")

    def _stance(self) -> None:
        phase, force = self.cycle.phase, self.cycle.grf_z
        if force.max() < _PEAK_FORCE:
            seen = f"has no stance: its peak is {force.max():.3g}"
            if force.min() < -_PEAK_FORCE:
                seen = f"has no stance but a trough of {force.min():.3g}: force of the foot on the ground?"
            self._refuse("grf_z_bw", seen, "the ground's force on the foot, upward positive, some 1.1")
        mean = float(np.trapezoid(force, phase))
        if not _MEAN_FORCE[0] <= mean <= _MEAN_FORCE[1]:
            seen = f"is {mean:.2g} body weights on average over the stride (is the body mass right?)"
            expected = f"{_MEAN_FORCE[0]:g} to {_MEAN_FORCE[1]:g}: each leg carries half of the body"
            self._refuse("grf_z_bw", seen, expected)
        share, start = stance(self.cycle), phase[np.argmax(force > STANCE_FORCE)]
        if start > _STANCE_START:
            seen = f"begins to rise at phase {start:.3g}"
            self._refuse("grf_z_bw", seen, "heel strike at phase 0")
        if not STANCE_SHARE[0] <= share <= STANCE_SHARE[1]:
            seen = f"is above {STANCE_FORCE:g} for {100 * share:.0f} % of the stride"
            low, high = (f"{100 * s:.0f}" for s in STANCE_SHARE)
            self._refuse("grf_z_bw", seen, f"a stance of {low} to {high} % and a swing without force")

    def _travel(self) -> None:
        way = self.cycle.ankle_x[-1] - self.cycle.ankle_x[0]
        expected = self.cycle.walking_speed * self.cycle.stride_time
        if abs(way - expected) <= _TRAVEL_ERROR * expected:
            self._slide()
            return
        seen = f"goes {way:.3g} m forward in the stride"
        if abs(way) < 0.2 * expected:
            seen += " (a treadmill without the belt's travel?)"
        elif abs(way + expected) <= _TRAVEL_ERROR * expected:
            seen += " (x backward?)"
        self._refuse("ankle_x_m", seen, f"overground, about speed × stride time = {expected:.3g} m")

    def _slide(self) -> None:
        flat = self.cycle.ankle_x[self._usual()]
        if not len(flat):
            expected = f"rows between phase {USUAL[0]:g} and {USUAL[1]:g}"
            self._refuse("phase", "has no row in mid-stance", expected)
        slide = float(flat[-1] - flat[0])
        if abs(slide) > _SLIDE:
            low, high = (f"{100.0 * share:.0f}" for share in USUAL)
            seen = f"goes {slide:+.3g} m between {low} and {high} % of the stride, "
            seen += "where the foot is on the floor"
            expected = "a foot that stays where it stands; of a treadmill the belt's travel, added once"
            self._refuse("ankle_x_m", seen, expected)

    def _period(self) -> None:
        for name, closing in closing_errors(self.cycle).items():
            angle = name.endswith("_deg")
            limit = _CLOSING_ANGLE if angle else _CLOSING_HEIGHT
            if abs(closing) > limit:
                unit = "deg" if angle else "m"
                seen = f"ends {closing:+.3g} {unit} from where it began"
                self._refuse(name, seen, f"one whole stride, closing within {limit:g} {unit}")

    def _angle_signs(self) -> None:
        cycle = self.cycle
        middle = (cycle.phase > 0.15) & (cycle.phase < 0.5)
        if np.polyfit(cycle.phase[middle], cycle.shank_angle[middle], 1)[0] < 0.0:
            seen = "falls during stance, where the knee passes over the ankle: wrong sign?"
            self._refuse("shank_angle_deg", seen, "positive with the knee ahead of the ankle")
        knee = self._column("knee_angle_deg")
        if knee.min() < -20.0 and -knee.min() > knee.max():
            seen = f"goes from {knee.min():.3g} to {knee.max():.3g}: wrong sign?"
            self._refuse("knee_angle_deg", seen, "flexion positive")
        flat = self._usual()
        pitch = np.degrees(cycle.foot_pitch()[flat])
        flipped = np.degrees(-cycle.ankle_angle - cycle.shank_angle)[flat]
        if np.ptp(pitch) > 8.0 and np.ptp(flipped) < 0.5 * np.ptp(pitch):
            seen = f"has the foot turn by {np.ptp(pitch):.3g} deg where it should lie flat, "
            seen += f"with the other sign by {np.ptp(flipped):.3g} deg"
            self._refuse("ankle_angle_deg", seen, "dorsiflexion positive")

    def _height(self) -> None:
        height = float(self.cycle.ankle_z[self.cycle.foot_flat()].mean())
        if abs(height - self.cycle.ankle_height) > HEIGHT_ERROR:
            expected = f"the stated ankle_height_m = {self.cycle.ankle_height:.3g} there (floor at 0)"
            seen = f"is {height:.3g} m on average over {self.cycle.flat.words}"
            self._refuse("ankle_z_m", seen, expected)

    def _moment(self) -> None:
        moment = self._column("ankle_moment_nm_per_kg")
        demand = -self.cycle.ground_moment()
        on = self.cycle.grf_z > STANCE_FORCE
        peak = np.abs(demand[on]).max()
        error, flipped = (np.sqrt(np.mean((s * moment - demand)[on] ** 2)) for s in (1.0, -1.0))
        if error <= MOMENT_ERROR * peak:
            return
        k = int(np.argmax(np.where(on, np.abs(demand), 0.0)))
        where = f"at phase {self.cycle.phase[k]:.2g}"
        seen = f"is {moment[k]:+.3g} {where}" + (": wrong sign?" if flipped < error else "")
        expected = "internal, plantarflexion positive; ground force and centre of pressure ask for "
        self._refuse("ankle_moment_nm_per_kg", seen, expected + f"{demand[k]:+.3g} {where}")


def stance(cycle: GaitCycle) -> float:
    """Share of the stride from heel strike to toe-off [-]."""
    loaded = cycle.phase[cycle.grf_z > STANCE_FORCE]
    loaded = loaded[loaded < LATE_SWING]  # what rises there is the next heel strike's
    return float(loaded[-1]) if len(loaded) else 0.0


def closing_errors(cycle: GaitCycle) -> dict[str, float]:
    """End minus beginning of each signal that should return, by column, in its unit."""
    columns = ("shank_angle_deg", "knee_angle_deg", "ankle_angle_deg", "ankle_z_m")
    return {c: cycle.series[COLUMNS[c][0]].closing_error / COLUMNS[c][1] for c in columns}


def closing_doubts(cycle: GaitCycle) -> list[Notice]:
    """A warning for each angle [deg] whose two ends are farther apart than usual; of any cycle."""
    text = (
        "the {subject} ends {off:+.1f} deg from where it began (usual: {limit:.0f} deg); that is spread "
        "evenly over the stride, so that its ends are off by half of it"
    )
    found = {name.removesuffix("_deg"): off for name, off in closing_errors(cycle).items() if "_deg" in name}
    return [
        Notice("stride-open", text, subject=name.replace("_", " "), off=off, limit=CLOSING_USUAL)
        for name, off in found.items()
        if abs(off) > CLOSING_USUAL
    ]


def findings(cycle: GaitCycle) -> list[tuple[str, str]]:
    """Findings on a gait cycle, in words and numbers for people: (subject, finding)."""
    ankle, flat = np.degrees(cycle.ankle_angle), cycle.foot_flat()
    pitch = np.degrees(cycle.foot_pitch()[flat])
    moment, demand = -cycle.ankle_moment, -cycle.ground_moment()
    top, bottom, peak = int(ankle.argmax()), int(ankle.argmin()), int(moment.argmax())
    on = cycle.grf_z > STANCE_FORCE
    error = np.sqrt(np.mean((moment - demand)[on] ** 2))
    low = int(np.where(on & (cycle.phase < LATE_SWING), moment, np.inf).argmin())
    length = cycle.ankle_x[-1] - cycle.ankle_x[0]
    closing = closing_errors(cycle)
    residual = {n: np.degrees(s.residual) for n, s in cycle.series.items() if n.endswith("_angle")}
    cop = cycle.cop_x[np.isfinite(cycle.cop_x)]
    # What is known of the walker: whose walk it is, size and shoe
    found: list[tuple[str, str]] = [("walker", cycle.walker or "not stated: a run asks for it")]
    if cycle.body_height is not None:
        found.append(("body height", f"{cycle.body_height:.2f} m"))
    if cycle.sole_thickness is not None:
        found.append(("sole worn", f"{1e3 * cycle.sole_thickness:.0f} mm under the ankle"))
    return [
        ("source", cycle.source),
        ("licence", cycle.licence),
        ("leg", f"{cycle.side}, of {cycle.body_mass:g} kg"),
        *found,
        ("stride", f"{cycle.stride_time:.3f} s, {length:.3f} m, {cycle.walking_speed:.3f} m/s"),
        ("stance", f"{100 * stance(cycle):.0f} % of the stride"),
        ("peak dorsiflexion", f"{ankle[top]:.1f} deg at {100 * cycle.phase[top]:.0f} %"),
        ("peak plantarflexion", f"{-ankle[bottom]:.1f} deg at {100 * cycle.phase[bottom]:.0f} %"),
        ("shank", _span(cycle.shank_angle)),
        ("knee", _span(cycle.knee_angle)),
        ("foot flat", cycle.flat.words + ("" if cycle.flat.steady else ", as usual: it is never steady")),
        (
            "foot pitch where flat",
            f"{pitch.mean():+.1f} deg on average, {pitch.min():+.1f} to {pitch.max():+.1f}",
        ),
        ("ankle height where flat", f"{100 * cycle.ankle_z[flat].mean():.1f} cm"),
        ("peak vertical force", f"{cycle.grf_z.max():.2f} body weights"),
        ("centre of pressure", f"{100 * cop.min():.1f} to {100 * cop.max():.1f} cm ahead of the ankle"),
        ("peak plantarflexor moment", f"{moment[peak]:.2f} N·m/kg at {100 * cycle.phase[peak]:.0f} %"),
        # a foot that only pushes has no dorsiflexor moment
        ("peak dorsiflexor moment", f"{max(0.0, -moment[low]):.2f} N·m/kg at {100 * cycle.phase[low]:.0f} %"),
        ("moment less ground force's", f"{error:.3f} N·m/kg RMS in stance"),
        (
            "taken out as drift",
            ", ".join(f"{n.split('_')[0]} {closing[f'{n}_deg']:+z.2f}" for n in residual)
            + f" deg, height {1e3 * closing['ankle_z_m']:+z.1f} mm",
        ),
        (
            f"left by {cycle.harmonics} harmonics",
            ", ".join(f"{n.split('_')[0]} {value:.2f}" for n, value in residual.items()) + " deg RMS",
        ),
    ] + [(key.replace("_", " "), text) for key, text in cycle.notes.items()]


def _span(angle: np.ndarray) -> str:
    return f"{np.degrees(angle.min()):.1f} to {np.degrees(angle.max()):.1f} deg"
