"""The shank's angle over a stride, of the population: what is known of a walker before the first stride."""

import functools
from dataclasses import dataclass

import numpy as np

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
SAMPLES = 512  # of a stride in which extremes are looked for


@dataclass(frozen=True, eq=False)
class Template:
    """Shank angle of a stride of a duration.

    series : (a₀, a₁, b₁, …) [rad] (2 `HARMONICS` + 1,)
    lowest, highest : phases of its extremes [-]
    low, high : its extremes [rad]
    """

    stride_time: float
    series: np.ndarray
    lowest: float
    highest: float
    low: float
    high: float

    @property
    def swing(self) -> float:
        """Time from the shank's highest to its lowest angle [s]."""
        return (self.lowest - self.highest) * self.stride_time


@functools.cache
def templates() -> tuple[Template, ...]:
    """Of strides from 0.6 s to 2.5 s, every 0.05 s."""
    return tuple(_template(float(time)) for time in np.arange(0.6, 2.51, 0.05))


def after_swing(duration: float) -> Template:
    """The template whose shank takes a time [s] from its highest to its lowest angle."""
    return min(templates(), key=lambda template: abs(template.swing - duration))


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
    lowest, highest = phase[shape.argmin()], phase[shape.argmax()]
    return Template(
        stride_time, series, float(lowest), float(highest), float(shape.min()), float(shape.max())
    )
