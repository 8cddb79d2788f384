"""Patients who make up for a foot that hangs, written from a healthy stride's file by its text alone."""

import math
import pathlib

THIGH, SHANK = 0.245, 0.246  # of body height: Winter 2009


def _rise(share: float) -> float:
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def write_patient(
    healthy: pathlib.Path, out: pathlib.Path, drop: float, knee: float = 0.0, hip: float = 0.0
) -> pathlib.Path:
    """Degrees that the ankle hangs lower in swing, and by which knee and hip are more bent in it.

    The hip keeps its path, so that what bends lifts the ankle.
    """
    lines = healthy.read_text(encoding="utf-8").splitlines()
    left_out = ("# walker", "# band", "# strides", "# mean", "# family", "# description")
    head = [line for line in lines if line.startswith("#") and not line.startswith(left_out)]
    names, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    at = {name: names.index(name) for name in names}
    height = next(float(line.split(":")[1]) for line in head if line.startswith("# body_height_m"))
    table = [[float(cell) if cell else math.nan for cell in row] for row in rows]
    toe_off = max(row[0] for row in table if row[at["grf_z_bw"]] > 0.05 and row[0] < 0.9)

    def hip_above(shank: float, bend: float) -> tuple[float, float]:
        lower, upper = SHANK * height, THIGH * height
        forward = lower * math.sin(shank) - upper * math.sin(bend - shank)
        return forward, lower * math.cos(shank) + upper * math.cos(bend - shank)

    for row in table:
        share = (row[0] - toe_off) / (1.0 - toe_off)
        held = _rise(share / 0.3) * _rise((1.0 - share) / 0.3)
        shank, bend = (math.radians(row[at[name]]) for name in ("shank_angle_deg", "knee_angle_deg"))
        more = math.radians(knee) * held
        swung = shank + more - math.radians(hip) * held
        before, after = hip_above(shank, bend), hip_above(swung, bend + more)
        row[at["shank_angle_deg"]], row[at["knee_angle_deg"]] = math.degrees(swung), math.degrees(bend + more)
        row[at["ankle_x_m"]] += before[0] - after[0]
        row[at["ankle_z_m"]] += before[1] - after[1]
        row[at["ankle_angle_deg"]] -= drop * held
    text = [*head, "# walker: patient", ",".join(names)]
    text += [",".join("" if math.isnan(cell) else f"{cell:.9g}" for cell in row) for row in table]
    out.write_text("\n".join(text) + "\n", encoding="utf-8")
    return out
