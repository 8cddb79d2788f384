"""MJCF of a compiled scenario: every number of the model reads again as it was; the start stands in a key."""

import ctypes
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from started_mjcf import started_mjcf

from afo_sim import native
from afo_sim.common import assets
from afo_sim.description import load
from afo_sim.model import Built, as_run, equilibrium, exact_xml, get_state, walking_start
from afo_sim.model.build import build
from afo_sim.model.supply_and_timer import controls

# Pictures alone have them: MJCF holds one size of a ball, and no width of what is not drawn
PICTURED = {"site_size", "tendon_width"}
BITS = mujoco.mjtDisableBit
UNUSED = int(BITS.mjDSBL_SPRING | BITS.mjDSBL_FRICTIONLOSS | BITS.mjDSBL_CLAMPCTRL)
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
OTHERS: dict[str, dict[str, Any]] = {
    "another person": {
        "patient": "drop-foot",
        "patient.body_mass": "93.7 kg",
        "patient.body_height": "1.63 m",
    },
    "surfaces": {"orthosis": "guided"},
    "air path": {"supply.source": "bottle_0_5l", "supply.regulator": "droop_tenth"},
    "left": {"side": "left"},
}


def unlike(one: mujoco.MjModel, other: mujoco.MjModel) -> set[str]:
    """Fields of two models that are not the same to the bit."""
    found = {"names"} if one.names != other.names else set()
    for told, first, second in (
        ("", one, other),
        ("opt.", one.opt, other.opt),
        ("stat.", one.stat, other.stat),
    ):
        for name in (name for name in dir(first) if not name.startswith("_")):
            value = getattr(first, name)
            if isinstance(value, int | float | np.ndarray) and not np.array_equal(
                value, getattr(second, name)
            ):
                found.add(told + name)
    return found


def same(built: Built, model: mujoco.MjModel) -> None:
    """All but what pictures have, and flags of what the model has none of, is as in the model that ran."""
    assert unlike(built.full_model, model) <= {*PICTURED, "opt.disableflags"}
    flags = built.full_model.opt.disableflags ^ model.opt.disableflags
    assert flags & ~UNUSED == 0
    stepped = {"actuator_user", "body_mass", "body_inertia", "jnt_stiffness", "dof_damping", "qpos0"}
    assert not stepped & unlike(built.model, model)
    assert mujoco.mj_stateSize(model, STATE) == mujoco.mj_stateSize(built.model, STATE)


@pytest.mark.parametrize("name", assets.names("scenario"))
def test_every_number_of_the_model_comes_back_from_mjcf(name: str) -> None:
    built = build(as_run(load("scenario", name)))
    same(built, mujoco.MjModel.from_xml_string(built.xml))


@pytest.mark.parametrize("other", OTHERS)
def test_what_is_written_into_the_compiled_model_comes_back_too(other: str) -> None:
    built = build(load("scenario", "walk-dropfoot-afo", {"duration": "0.1 s"} | OTHERS[other]))
    same(built, mujoco.MjModel.from_xml_string(built.xml))


@pytest.fixture
def started() -> tuple[Built, np.ndarray]:
    built = build(load("scenario", "seated", {"duration": "0.1 s"}))
    with native.installed():
        return built, equilibrium(built, controls(built, 1)[0])


def test_the_key_is_the_state_at_the_start(started: tuple[Built, np.ndarray]) -> None:
    built, state = started
    model = mujoco.MjModel.from_xml_string(started_mjcf(built, state))
    data, begun = mujoco.MjData(model), mujoco.MjData(built.model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("afo_start").id)
    mujoco.mj_setState(built.model, begun, state, STATE)
    begun.userdata[:] = begun.qacc_warmstart[:] = 0.0
    assert np.array_equal(get_state(model, data), get_state(built.model, begun))
    assert np.count_nonzero(data.act) > 8 and np.count_nonzero(data.ctrl) > 2


@pytest.mark.parametrize("other", ["surfaces", "air path", "drive"])
def test_no_step_reads_what_the_last_one_left_in_userdata(other: str) -> None:
    """With no number there, which any sum would pass on, it steps to the same bits."""
    drive = {"drive.dorsiflexor": {"kind": "bang_bang", "dead_band": "50 mbar", "least_on": "8 ms"}}
    sets = {"duration": "0.3 s", "gait.settled": "walked"} | OTHERS.get(other, drive)
    built = build(load("scenario", "walk-dropfoot-afo", sets))
    model, inputs = built.model, controls(built)
    inputs[:, list(built.index.drives.values())] = 2e5
    rows = []
    with native.installed():
        start = walking_start(built, inputs[0])
        for left in (0.0, np.nan):
            data = mujoco.MjData(model)
            mujoco.mj_setState(model, data, start, STATE)
            data.userdata[:] = left
            data.qacc_warmstart[:] = 0.0
            for row in inputs:
                data.ctrl[:] = row
                mujoco.mj_step(model, data)
            rows.append(np.concatenate([data.qpos, data.qvel, data.act, data.userdata]))
    assert np.isfinite(rows[0]).all() and np.array_equal(*rows)


def test_the_plugin_stands_where_mujoco_looks_for_it(started: tuple[Built, np.ndarray]) -> None:
    """An instance, on the leg's first body; the package's library has registered it in this process."""
    text = started_mjcf(*started, plugin=True)
    tree = ElementTree.fromstring(text)
    assert [each.get("plugin") for each in tree.iterfind("extension/plugin")] == ["afo_sim.muscles"]
    with pytest.raises(ValueError, match=r"afo_sim\.unknown"):
        mujoco.MjModel.from_xml_string(text.replace("afo_sim.muscles", "afo_sim.unknown"))
    model = mujoco.MjModel.from_xml_string(text)
    assert model.nplugin == 1 and model.nbody > 3
    assert model.body_plugin.tolist() == [-1, 0, *[-1] * (model.nbody - 2)]
    assert mujoco.MjModel.from_xml_string(started_mjcf(*started)).nplugin == 0


class WithoutSetting:
    """A library that has no symbol of any name."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


def test_digits_are_mujocos_own_again_and_six_where_it_has_no_setting(
    started: tuple[Built, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = started[0].spec
    plain, exact = spec.to_xml(), exact_xml(spec)
    assert len(exact) > len(plain) == len(spec.to_xml())
    monkeypatch.setattr(ctypes, "CDLL", lambda path: WithoutSetting())
    assert exact_xml(spec) == plain
