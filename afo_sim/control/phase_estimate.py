"""The gait phase from the shank's angle: an oscillator that learns the walker, and stops when he stops.

The walker's first swing starts it: from its highest angle to its lowest the shank takes a known share of the
stride. From there an oscillator (`physics/oscillator.py`) follows the angle. What it knows before the first
stride is the population's shank (`Shank`), which also says where in the shape the heel strikes.
It learns the walker's own shape, and where in it his heel strikes: from what the strike does to the shank
(`heel_strike.py`), or from a foot switch.

Where the angle is not as expected, its size and mean are trusted the less: a turn or a short step halves the
one and moves the other at once, and the phase then comes from when the shank turns round, not from how far
it goes. It is believed after the angle has agreed with what was expected for most of a stride, and no longer
when it does not, when a swing is not like his others, or when his pace changes within a stride.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np

from afo_sim.control.heel_strike import HeelStrike
from afo_sim.control.swings import Swing, Swings, UsualSwings
from afo_sim.physics import SHAPE, advance, correct, loosen_size
from afo_sim.physics.oscillator import origin, series, turn

HARMONICS = 6
# Shank from the vertical, knee ahead positive [deg], every 5 % of the stride: knee − (hip − pelvic tilt),
# derived from the published means of children at free speed (Schwartz, Rozumalski & Trost 2008, J. Biomech.
# 41:1639).
SHANK = (
    *(-18.0, -11.1, -3.3, 1.6, 5.0, 7.8, 10.4, 13.4, 17.0, 22.2),
    *(28.9, 37.2, 45.6, 51.4, 51.2, 43.1, 29.4, 12.0, -5.7, -17.5, -18.2),
)
# Stance is the shorter the faster the stride: 59.1, 60.3 and 61.8 % at 132.3, 114.7 and 97.9 steps a minute,
# published means of 42 adults (Fukuchi, Fukuchi & Duarte 2018). A line through them; assumed beyond them.
STANCE, STANCE_TIME, STANCE_RATE = 0.603, 1.046, 0.085  # [-] at [s], and what it gains per time [1/s]
SHORTEST, LONGEST = 0.8, 1.8  # stride times beyond which stance stays as it is [s]
SAMPLES, EXTREMES = 512, 128  # of a stride of the published curve; in which extremes are looked for


@dataclass(frozen=True, eq=False)
class Template:
    """Shank angle of a stride of a duration."""

    stride_time: float
    series: np.ndarray
    lowest: float
    highest: float
    low: float
    high: float


@functools.cache
def templates() -> tuple[Template, ...]:
    """Of strides from 0.6 s to 2.5 s, every 0.05 s."""
    return tuple(_template(float(time)) for time in np.arange(0.6, 2.51, 0.05))


def after_swing(duration: float) -> Template:
    """The template whose shank takes a time [s] from its highest to its lowest angle."""
    return min(templates(), key=lambda each: abs((each.lowest - each.highest) * each.stride_time - duration))


def _template(stride_time: float) -> Template:
    """The published curve with its stance as long as at this stride time, its swing in the rest."""
    angles = np.radians(SHANK)
    angles = angles - (angles[-1] - angles[0]) * np.linspace(-0.5, 0.5, len(angles))  # it closes
    smooth = np.fft.rfft(angles[:-1])[:-1] / (len(angles) - 1)
    phase = np.arange(SAMPLES) / SAMPLES
    stance = STANCE + STANCE_RATE * (min(max(stride_time, SHORTEST), LONGEST) - STANCE_TIME)
    published = np.interp(phase, [0.0, stance, 1.0], [0.0, STANCE, 1.0])
    wave = np.exp(2j * np.pi * np.outer(published, np.arange(len(smooth))))
    shape = 2.0 * (wave @ smooth).real - smooth[0].real
    found = np.fft.rfft(shape)[: HARMONICS + 1] / SAMPLES
    series = np.empty(2 * HARMONICS + 1)
    series[0], series[1::2], series[2::2] = found[0].real, 2.0 * found[1:].real, -2.0 * found[1:].imag
    return template_of(stride_time, series)


@functools.cache
def _waves() -> np.ndarray:
    order = np.arange(1, HARMONICS + 1)
    angle = 2.0 * np.pi * np.outer(np.arange(EXTREMES) / EXTREMES, order)
    waves = np.ones((EXTREMES, 2 * HARMONICS + 1))
    waves[:, 1::2], waves[:, 2::2] = np.cos(angle), np.sin(angle)
    return waves


def template_of(stride_time: float, series: np.ndarray) -> Template:
    """The template of a series; its lowest angle comes after its highest."""
    shape = _waves() @ series
    lowest, highest = int(shape.argmin()), int(shape.argmax())
    phases = (lowest if lowest > highest else lowest + EXTREMES) / EXTREMES, highest / EXTREMES
    return Template(stride_time, series, *phases, float(shape[lowest]), float(shape[highest]))


# The numbers below are assumed; they were tried on drawn people (docs/phase.md).
SLOWEST, FASTEST = 0.2, 3.0  # rate of strides [1/s]
# Phase by which a swing may differ from the oscillator before this begins anew, alone and with a foot switch,
# and by which a heel strike may before it is believed more than the shape [-]
AGREES, AGREES_STRUCK, LATE = 0.08, 0.2, 0.08
UNLIKE_SWING = math.radians(8.0)  # by which the extremes of the shape may differ from those of the swing
# What is not known when it begins: phase [-], rate [-] of itself, mean and first harmonic of the angle; the
# others go with one over their order. Half as much of a shape that the walker has shown before.
PHASE, RATE, AGAIN = 0.04, 0.25, 0.5
MEAN, FIRST = math.radians(6.0), math.radians(4.0)
UNSTEADY = 0.3  # by which the rate wanders in a stride, of itself
# By which the angle's size wanders in a stride, of itself, and its mean [rad], while the misfit (below) is as
# large as `LEARNT`; their variances fall with its square.
SIZE, SHIFT = 0.28, 0.095
UNLIKE = math.radians(0.2)  # by which the shape wanders in a second
# Error of a sample every 10 ms: at first of the shape, which it forgets in so many strides; later of the
# sensor, and of strides that differ.
BEGUN, LEARNT, FORGOTTEN, SAMPLE = math.radians(3.5), math.radians(1.5), 2.5, 0.01
STRIKE = 0.006  # error of a foot switch [-]
# The angle agrees while its misfit, a root mean square over so much of a stride, stays below the first;
# beyond the second the shape is not this walker's any more.
MISFIT, LOST, RECENT = math.radians(1.6), math.radians(7.0), 0.05
# Noise is taken out of the misfit over a share of a stride, and over a time [s] out of the angle in which
# swings and stops are looked for; how large it is, neighbouring samples tell, over half a stride.
MISFIT_FILTER, ANGLE_FILTER, NOISY = 0.04, 0.02, 0.5
PACE = 0.25  # by which the rate may differ from the last stride's, of itself
AGREED, AGREED_STANDING = 0.9, 0.75  # strides that it agreed for until it is believed; of who stands
CERTAIN = 0.04  # standard deviation of a phase that is believed [-]
# Who stands moves the shank less in so long [rad], [s]: who walks slowly turns it round as slowly, so that it
# is looked at for a share of the stride, within bounds; for the longest while no stride is known.
STILL, WINDOW, SHARE = math.radians(0.9), (0.25, 0.5), 0.28
# Least time from one look for that to the next [s], and looks that are kept. A look falls on a sample: at
# 100 Hz they are 30 ms apart, and the time above is a fifth longer; at 50 Hz 40 ms and three fifths.
LOOK, LOOKS = 0.025, 20
WAKING = 0.3, 0.03  # what is not known of who stands: rate [1/s], phase [-]
SEEN, HOLD = 1.5, 10.0  # strides in which a foot switch counts; how often a stride turns the shape back
AVERAGED = 2.0  # how often a stride the rate that is stated is renewed
STRIDES = 0.33, 5.0  # durations of a stride [s]
AGAINST = 2  # swings, one after the other, that contradict a shape until it is not used any more
UNEVEN = 3  # swings, one after the other, at whose pace the shape must be wrong
# Phase at which the strike's place is looked for, and by which, behind an extreme, it has been seen or not.
LOOKED, HIGH_PAST, LOW_PAST = 0.25, 0.05, 0.1
MOVES = 2.0  # how often a stride the heel strike moves to where it was found
BACK = 0.05  # phase by which it waits instead of running back [-]
# Time without a sample after which the phase is not believed [s]: at a stride a second it has gone on by
# `CERTAIN`, and is off by as much if the walker stopped meanwhile. The slack is for rounding.
GAP = 0.05 + 1e-4


class PhaseEstimate:
    """Estimator of gait phase and stride time from samples of the shank's angle."""

    def __init__(self, lead: float = 0.0) -> None:
        self._lead = lead
        self.reset()

    def reset(self) -> None:
        """Forget the walker."""
        self._swings, self._usual, self._heel = Swings(), UsualSwings(), HeelStrike()
        self._shift = 0.0  # of phase 0, to where the heel was found to strike
        self._calibrated = False  # by a foot switch
        self._window = WINDOW[1]  # in which who stands is found [s]
        self._looks = np.zeros((LOOKS, 2))  # the latest last: angle, phase
        self._looked, self._since_look = 0, 0.0
        self._state = np.zeros(SHAPE + 2 * HARMONICS + 1)
        self._covariance = np.zeros((len(self._state), len(self._state)))
        self._wave = np.zeros(len(self._state))
        self._striking = np.zeros(len(self._state))
        self._striking[0] = 1.0  # of the state, what a foot switch measures
        self._follows = False
        self._age = 0.0  # of the shape, strides
        self._agreed = 0.0  # strides, since the angle was last not as expected
        self._misfit = self._worst = 0.0  # mean square of late, and its largest since the last swing [rad²]
        self._noise = 0.0  # mean square of the sensor's [rad²]
        self._filtered, self._innovation = math.nan, 0.0  # angle, and what it differs by, of late [rad]
        self._last = math.nan  # what the last sample's differed by
        self._stated = -math.inf  # phase, with whole strides
        self._rate = 0.0  # of strides of late [1/s]
        self._cadence = 0.0  # rate of the last whole stride [1/s]
        self._off_pace = False  # the rate has been another since a usual swing
        self._uneven = 0  # swings, one after the other, that ended with that
        self._kept: Template | None = None  # shape of the walker when it was believed
        self._against = 0  # swings, since one agreed
        self._origin = 0.0  # of the shape, to which it is held
        self._unstruck = math.inf  # strides since the foot switch closed
        self._since_strike = self._since_swing = math.inf  # [s]
        self._gap = 0.0  # since the last sample that was not lost [s]
        self.stopped = False

    @property
    def phase(self) -> float:
        """Gait phase, 0 = heel strike, below 1; NaN before the first swing."""
        return self._stated % 1.0 if self._follows else math.nan

    @property
    def stride_time(self) -> float:
        """Duration of a stride at the recent rate [s]: up to 5 s while standing, NaN before a first swing."""
        return 1.0 / max(self._rate, SLOWEST) if self._follows else math.nan

    @property
    def ready(self) -> bool:
        """Whether the angle has agreed with the phase for long enough to believe it."""
        return (
            self._follows
            and not (self._usual.strange or self._off_pace)
            and self._agreed >= AGREED
            and float(self._covariance[0, 0]) < CERTAIN**2
        )

    @property
    def heel_strike(self) -> int:
        """What phase 0 is known from: 2 a foot switch, 1 the shank's dip at heel strike, 0 other people's."""
        return 2 if self._calibrated else int(self._heel.seen)

    def update(self, value: float, dt: float, struck: bool = False) -> None:
        """Take in a sample; while samples are lost (not finite), the phase continues at its rate."""
        if not dt > 0.0:
            return
        lost, self._gap = self._gap, 0.0 if math.isfinite(value) else self._gap + dt
        if not self._gap:
            known = math.isfinite(self._filtered) and lost <= WINDOW[0]
            self._filtered += (
                min((dt + lost) / ANGLE_FILTER, 1.0) * (value - self._filtered) if known else 0.0
            )
            self._filtered = self._filtered if known else value
        if self._gap > GAP:
            self._agreed = 0.0
        if self._gap > WINDOW[0] + 1e-4:  # the shank may have turned round unseen
            self._forget_swing()
        stood, self.stopped = self.stopped, self._stands(dt)
        self._since_swing += dt
        self._since_strike += dt
        if self.stopped:
            if not self._gap:
                self._stand(dt, begins=not stood)
            return
        if stood:
            self._state[1] = self._cadence  # he goes on as fast as he walked before
        swing = self._swings.after(math.nan if self._gap else self._filtered, dt)
        if swing is not None:
            self._swung(swing._replace(ago=swing.ago + max(ANGLE_FILTER - dt, 0.0)))
        if self._follows:
            self._follow(value, dt, struck)

    def _stands(self, dt: float) -> bool:
        """Whether the shank has hardly moved of late."""
        self._since_look += dt
        if self._gap or self._since_look < LOOK - 1e-4:
            return self.stopped
        self._since_look = 0.0
        self._looks[:-1] = self._looks[1:]
        self._looks[-1] = self._filtered, self._state[0]
        self._looked += 1
        angles = self._looks[-self._enough :, 0]
        noise = self._noise * _left_over(dt / ANGLE_FILTER)
        return self._looked >= self._enough and float(np.var(angles)) - noise < STILL**2

    @property
    def _enough(self) -> int:
        return int(self._window / LOOK + 0.5)

    def _stand(self, dt: float, begins: bool) -> None:
        """The phase stays where it was when he stopped; how fast it goes on is not known."""
        self._forget_swing()
        if not self._follows:
            return
        gone = self._state[0] - self._looks[-self._enough, 1]
        if begins and 0.0 < gone < 0.5:
            self._state[0] -= gone
            self._stated = float(self._state[0]) - self._shift
        if begins and self._kept:  # what seemed to be another shape was that he stopped
            self._state[SHAPE:] = self._kept.series
            self._off_pace = False
        rate, phase = WAKING
        self._state[1] = 0.0
        self._covariance[1, :] = self._covariance[:, 1] = 0.0
        self._covariance[1, 1] = rate**2
        self._covariance[0, 0] = max(self._covariance[0, 0], phase**2)
        expected, slope = series(self._state, self._wave)
        off = abs(self._filtered - expected) - CERTAIN * abs(
            slope
        )  # more than an error of the phase explains
        self._misfit = max(off, 0.0) ** 2
        self._agreed = AGREED_STANDING if self._misfit < MISFIT**2 and self._kept else 0.0
        self._averaged(dt)

    def _forget_swing(self) -> None:
        self._swings = Swings()
        self._since_swing = self._since_strike = self._unstruck = math.inf

    def _loosen(self, phase: float, rate: float) -> None:
        self._covariance[:SHAPE, :] = 0.0
        self._covariance[:, :SHAPE] = 0.0
        self._covariance[0, 0], self._covariance[1, 1] = phase, rate

    def _swung(self, swing: Swing) -> None:
        """Begin with a swing, or anew where it contradicts the oscillator."""
        like = after_swing(swing.duration)
        if self._against >= AGAINST:
            self._kept = None
        template = self._kept or like
        rate = (template.lowest - template.highest) / swing.duration
        if not SLOWEST < rate < FASTEST:
            return
        self._usual.take(swing)
        self._uneven = self._uneven + 1 if self._off_pace else 0
        self._off_pace &= self._usual.strange
        if self._usual.returned and self._kept and self._follows:
            phase = float(self._state[0])
            self._state[SHAPE:] = self._kept.series
            self._turn_to_own()
            self._state[0] = phase
        self._window = min(max(SHARE * like.stride_time, WINDOW[0]), WINDOW[1])
        stride = self._since_swing - swing.ago
        self._since_swing = swing.ago
        whole = STRIDES[0] < stride < STRIDES[1]
        self._cadence = 1.0 / stride if whole else self._cadence or rate
        phase = template.lowest + rate * swing.ago
        shape = template_of(like.stride_time, self._state[SHAPE:].copy())
        near = AGREES_STRUCK if self._unstruck < SEEN else AGREES
        if (
            not self._follows  # nor are phase, pace and shape those of a swing that ends here
            or self._uneven >= UNEVEN
            or abs(_apart(self._state[0], phase)) > near
            or max(abs(shape.high - swing.high), abs(shape.low - swing.low)) > UNLIKE_SWING
            or self._worst > LOST**2
        ):
            self._begin(template, swing)
            self._state[:SHAPE] = phase, self._cadence
            self._turn_to_own()
            self._loosen(PHASE**2, (RATE * rate) ** 2)
        else:
            self._against = 0
            if self._agreed > 1.0 and self._usual.at_home:
                self._kept = shape
        self._worst = 0.0

    def _turn_to_own(self) -> None:
        if self._calibrated:
            turn(self._state, _apart(self._origin, origin(self._state)))

    def _begin(self, template: Template, swing: Swing) -> None:
        """Begin with a shape, between this swing's extremes."""
        share = (swing.high - swing.low) / (template.high - template.low)
        self._state[SHAPE:] = share * template.series
        self._state[SHAPE] += 0.5 * (swing.high + swing.low - share * (template.high + template.low))
        first = FIRST * (AGAIN if self._kept else 1.0)
        order = np.repeat(np.arange(1, HARMONICS + 1), 2)
        self._covariance[:, :] = np.diag(np.concatenate([[0.0, 0.0, MEAN**2], (first / order) ** 2]))
        if not self._calibrated:
            self._origin = origin(self._state)
        if not self._kept:
            self._age = 0.0
            self._heel.forget()
        self._against += 1
        self._uneven = 0
        self._follows, self._stated, self._rate = True, -math.inf, self._cadence
        self._agreed = self._misfit = self._innovation = 0.0
        self._last = math.nan

    def _follow(self, value: float, dt: float, struck: bool) -> None:
        """Go on by a sample."""
        state, covariance, wave = self._state, self._covariance, self._wave
        began, rate = float(state[0]), float(state[1])
        gone = rate * dt
        self._age += gone
        self._unstruck += gone
        # as much in a stride of any duration; who starts has a rate of 0
        advance(state, covariance, dt, UNSTEADY**2 * max(rate**3, 0.1), UNLIKE**2)
        loose = dt * max(rate, SLOWEST) * min(max(self._misfit, 0.0) / LEARNT**2, 1.0)
        loosen_size(state, covariance, SIZE**2 * loose, SHIFT**2 * loose)
        if not self._gap:
            innovation, part = value - series(state, wave)[0], max(gone, 0.5 * dt)  # [rad], of a stride
            # judge the angle by its difference from what was expected
            if self._agreed > 0.0 and math.isfinite(self._last):
                self._noise += min(part / NOISY, 1.0) * (0.5 * (innovation - self._last) ** 2 - self._noise)
            self._last = innovation
            gain = min(part / MISFIT_FILTER, 1.0)
            self._innovation += gain * (innovation - self._innovation)
            off = self._innovation**2 - _left_over(gain) * self._noise
            self._misfit += min(part / RECENT, 1.0) * (off - self._misfit)
            self._worst = max(self._worst, self._misfit)
            self._agreed = self._agreed + part if self._misfit < MISFIT**2 else 0.0
            error = LEARNT + (BEGUN - LEARNT) * math.exp(-self._age / FORGOTTEN)
            correct(state, covariance, wave, innovation, error**2 * SAMPLE / dt + self._noise)
            if self._agreed > 0.5 and not self._usual.strange:
                self._heel.take(float(state[0]), innovation, gone)
        if struck:
            self._strike(dt)
        # the shape is kept where it lies in the stride, else each stride's share of errors would turn it on
        if self._unstruck > SEEN:
            turn(state, gone * HOLD * _apart(self._origin, origin(state)))
        elif self._agreed > 1.0 and not self._usual.strange:
            self._origin, self._calibrated = origin(state), True
        self._look(began)
        self._shift += min(MOVES * gone, 1.0) * (self._heel.phase - self._shift)
        state[1] = min(max(state[1], 0.0), FASTEST)
        self._averaged(dt)
        phase = float(state[0] + state[1] * self._lead) - self._shift
        if not 0.0 < self._stated - phase < BACK:
            self._stated = phase

    def _look(self, began: float) -> None:
        """Look at the pace, and where a phase has been passed in a sample, for heel strike and swing."""
        phase = float(self._state[0])

        def passed(at: float) -> bool:
            return -0.2 < _apart(began, at) < 0.0 <= _apart(phase, at)

        if self._unstruck > SEEN and not self._calibrated and passed(LOOKED):
            self._heel.find(self._noise, self._rate)
        if not math.isfinite(self._since_swing):  # he has stood, and begins as he likes
            return
        self._off_pace |= abs(float(self._state[1]) - self._cadence) > PACE * self._cadence
        if self._kept and passed(self._kept.highest + HIGH_PAST):
            self._usual.expect(self._swings.high)
        if self._kept and passed(self._kept.lowest + LOW_PAST) and self._since_swing * self._state[1] > 0.5:
            self._usual.miss()

    def _strike(self, dt: float) -> None:
        """Take in a heel strike: a little of phase, or all where the shape has it elsewhere."""
        late = _apart(self._shift + 0.5 * dt * self._state[1], self._state[0])  # it closed half a sample ago
        if STRIDES[0] < self._since_strike < STRIDES[1]:
            self._cadence = 1.0 / self._since_strike
        if abs(late) < LATE:
            correct(self._state, self._covariance, self._striking, late, STRIKE**2)
        else:
            if self._misfit < MISFIT**2:
                turn(self._state, late)  # the shape is the walker's, at another phase
            else:
                self._state[:SHAPE] = self._state[0] + late, self._cadence
            self._loosen(STRIKE**2, (0.5 * RATE * self._cadence) ** 2)
            self._stated, self._agreed = -math.inf, 0.0
        self._unstruck, self._since_strike = 0.0, 0.5 * dt
        self._last = math.nan  # the phase has jumped, and what is expected with it

    def _averaged(self, dt: float) -> None:
        """The rate over about half a stride: within a stride it errs to either side."""
        self._rate += (self._state[1] - self._rate) * min(AVERAGED * dt * max(self._rate, SLOWEST), 1.0)


def _apart(phase: float, other: float) -> float:
    """How far a phase is ahead of another, from −½ to ½ [-]."""
    return (phase - other + 0.5) % 1.0 - 0.5


def _left_over(gain: float) -> float:
    """Share of a white noise's variance that a running mean of a gain leaves."""
    gain = min(gain, 1.0)
    return gain / (2.0 - gain)
