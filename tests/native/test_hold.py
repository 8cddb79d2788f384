"""The callbacks held by several at once: there while anybody holds them, and gone after the last."""

import copy
import gc
import itertools
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator

import mujoco
import pytest

from afo_sim import native
from afo_sim.common import CallbackError


def pair() -> tuple[object, object]:
    return mujoco.get_mjcb_act_bias(), mujoco.get_mjcb_act_dyn()


NONE = (None, None)


@pytest.fixture(autouse=True)
def nothing_is_left() -> Iterator[None]:
    assert pair() == NONE
    loud = mujoco.get_mju_user_warning()
    yield
    left, warns = pair(), mujoco.get_mju_user_warning()
    mujoco.set_mjcb_act_bias(None)
    mujoco.set_mjcb_act_dyn(None)
    assert left == NONE
    assert warns is loud


def foreign(model: object, data: object, i: int) -> float:
    return 0.0


@pytest.mark.parametrize("mode", ["native", "python"])
def test_the_first_installs_and_the_last_restores_in_any_order(mode: native.Mode) -> None:
    for order in itertools.permutations(range(3)):
        holds = [native.Hold(mode) for _ in range(3)]
        held = pair()
        assert None not in held
        for k in order:
            assert pair() == held
            holds[k].check()
            holds[k].close()
            holds[k].close()
        assert pair() == NONE


def test_a_block_within_and_around_a_hold_leaves_it_alone() -> None:
    with native.installed():
        within = native.Hold()
        held = pair()
    assert pair() == held
    within.check()
    with native.installed():
        within.close()
        assert pair() == held  # of the block, which goes on
    assert pair() == NONE
    with native.Hold() as around, native.installed():
        pass
    assert around.closed


def test_an_exception_ends_a_hold_and_a_block_but_not_its_neighbour() -> None:
    other = native.Hold()
    with pytest.raises(RuntimeError, match="mine"), native.Hold(), native.installed():
        raise RuntimeError("mine")
    other.check()
    other.close()


def test_garbage_collection_closes() -> None:
    hold = native.Hold()
    del hold
    assert pair() == NONE
    circle: list[object] = [native.Hold()]
    circle.append(circle)
    del circle
    gc.collect()
    assert pair() == NONE


def test_what_is_closed_is_refused() -> None:
    hold = native.Hold()
    hold.close()
    with pytest.raises(CallbackError, match="closed"):
        hold.check()


def test_another_programs_callback_is_not_displaced() -> None:
    mujoco.set_mjcb_act_dyn(foreign)
    with pytest.raises(CallbackError, match="another mjcb_act_dyn"):
        native.Hold()
    assert pair() == (None, foreign)
    mujoco.set_mjcb_act_dyn(None)
    native.Hold().close()  # the refused one has left no holder behind


def test_a_replaced_callback_is_noticed_and_left_where_it_is() -> None:
    hold = native.Hold()
    mujoco.set_mjcb_act_bias(foreign)
    with pytest.raises(CallbackError, match="replaced"):
        hold.check()
    with pytest.raises(CallbackError, match="replaced"):
        native.Hold()
    with pytest.raises(CallbackError, match="replaced"), native.installed():
        pass
    hold.close()
    assert pair() == (foreign, None)
    mujoco.set_mjcb_act_bias(None)


@pytest.mark.parametrize(("first", "second"), [("native", "python"), ("python", "native")])
def test_two_modes_at_once_are_refused(first: native.Mode, second: native.Mode) -> None:
    hold = native.Hold(first)
    held, told = pair(), []
    with pytest.raises(CallbackError, match=f"held in the mode '{first}'"):
        native.Hold(second)

    def other_thread() -> None:
        with pytest.raises(CallbackError, match="held in the mode") as caught, native.installed(second):
            pass
        told.append(caught)

    thread = threading.Thread(target=other_thread)
    thread.start()
    thread.join()
    assert told and pair() == held
    hold.close()
    native.Hold(second).close()


@pytest.mark.parametrize(("first", "second"), [("native", "python"), ("python", "native")])
def test_a_block_of_the_other_mode_lies_within(first: native.Mode, second: native.Mode) -> None:
    with native.Hold(first) as hold:
        held = pair()
        with native.installed(second):
            assert pair() != held
            with native.installed(second), native.installed(first):
                assert pair() == held
            assert pair() != held
        assert pair() == held
        with pytest.raises(ZeroDivisionError), native.installed(second):
            _ = 1 / 0
        assert pair() == held
        hold.check()


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_hold_is_not_copied(copied: object) -> None:
    with native.Hold() as hold, pytest.raises(TypeError, match="opens another"):
        copied(hold)  # type: ignore[operator]


def test_a_users_warning_handler_stays() -> None:
    told: list[str] = []
    before = mujoco.get_mju_user_warning()  # dm_control has one, once it is imported
    mujoco.set_mju_user_warning(told.append)
    mine = mujoco.get_mju_user_warning()
    with native.Hold():
        assert mujoco.get_mju_user_warning() is mine
    assert mujoco.get_mju_user_warning() is mine
    mujoco.set_mju_user_warning(None)
    with native.Hold():
        assert mujoco.get_mju_user_warning() is not None  # silent: the counters say the same
        mujoco.set_mju_user_warning(mine)
    assert mujoco.get_mju_user_warning() is mine  # set under the hold, and not taken away
    mujoco.set_mju_user_warning(before)


def test_threads_never_see_a_gap() -> None:
    native.Hold().close()  # compiled once
    gaps: list[int] = []

    def work() -> None:
        for _ in range(300):
            with native.Hold() as hold:
                hold.check()
                gaps.extend([1] if None in pair() else [])

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not gaps


@pytest.mark.parametrize("mode", ["native", "python"])
def test_python_ends_well_with_holds_left_open(mode: str) -> None:
    code = (
        "import gc, mujoco\nfrom afo_sim import native\n"
        f"holds = [native.Hold({mode!r}) for _ in range(3)]\n"
        f"circle = [native.Hold({mode!r})]; circle.append(circle); holds[1].close()\n"
        "model = mujoco.MjModel.from_xml_string('<mujoco/>'); mujoco.mj_step(model, mujoco.MjData(model))\n"
        "print('done')"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "done\n", "")
