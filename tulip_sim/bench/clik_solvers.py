"""Ours, Pink and PlaCo, each following the same recorded walk."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.robot import LEG_JOINTS
from tulip_description.urdf import build_urdf
from tulip_motion.inverse_kinematics import InverseKinematics
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench import clik_placo
from tulip_sim.bench.clik_reference import Instant, WalkReference, legs, legs_model, walk_reference

Array = NDArray[np.float64]

DT = MotionParameters().control_period
PINK_DAMPING = 1e-6  # its quadratic program has no solution at a singular posture without
SOLES = (frames.LEFT_SOLE, frames.RIGHT_SOLE)
ROOT = Path(__file__).resolve().parents[2]
PLACO_ENVIRONMENT = ROOT / ".venv-placo"
PLACO = "placo>=0.10,<1"
PINK_MISSING = "Pink is not installed; install it with the extra `bench`: pip install -e '.[bench]'"


@dataclass(frozen=True)
class Replay:
    """What a solver did.

    Attributes:
        seconds: (n - 1,) time of each solve [s].
        postures: (n - 1, 19) base pose and joint angles after each.
        remark: How the solver was set up, in words.
    """

    seconds: Array
    postures: Array
    remark: str = ""


def replay_own(reference: WalkReference, dead_beat: bool = False) -> Replay:
    """Follow the walk by this project's solver.

    Args:
        reference: The walk.
        dead_beat: Whether to do as Pink and PlaCo do, who know no velocities of a target: be at the next instant's
            places after one tick. Otherwise as motion control does: places and velocities of now, and K_p = 20 / s.
    """
    p, model = MotionParameters(), legs_model()
    gains = (1.0 / DT, 1.0 / DT) if dead_beat else (p.clik_gain_position, p.clik_gain_orientation)
    kinematics = InverseKinematics(model, *gains, legs().position_limits[:, :12])
    kinematics.configuration[:] = reference.start
    instants = [at_rest(instant) for instant in reference.instants[1:]] if dead_beat else reference.instants[:-1]
    seconds, postures = [], []
    for instant in instants:
        begun = time.perf_counter()
        kinematics.update_jacobian(instant.stance)
        kinematics.solve_velocity(instant.target)
        kinematics.integrate(DT, instant.anchor)
        seconds.append(time.perf_counter() - begun)
        postures.append(kinematics.configuration)
    gain = "gain 1 in one tick" if dead_beat else f"gain {p.clik_gain_position:g} / s and the target's velocity"
    return Replay(np.array(seconds), np.array(postures), f"{gain}; joint and speed limits kept")


def at_rest(instant: Instant) -> Instant:
    """Return the same places without velocities."""
    target, zero = instant.target, (0.0, 0.0, 0.0)
    foot = target.foot._replace(velocity=zero, yaw_rate=0.0)
    return replace(instant, target=target._replace(com_velocity=zero, torso_angular_velocity=zero, foot=foot))


def replay_pink(reference: WalkReference, limited: bool, solver: str | None = None) -> Replay:
    """Follow the walk by Pink, which reaches the next instant's places in one tick (gain 1).

    Args:
        reference: The walk.
        limited: Whether joint and speed limits are constraints of its quadratic program.
        solver: Of the quadratic program; by default the fastest that is installed.
    """
    import pink
    from pink.tasks import ComTask, FrameTask

    solver = solver or fastest_qp_solver(limited)
    model = legs_model()
    configuration = pink.Configuration(model, model.createData(), reference.start)
    com, torso = ComTask(cost=1.0), FrameTask(frames.BASE_LINK, position_cost=0.0, orientation_cost=1.0)
    feet = [FrameTask(name, position_cost=1.0, orientation_cost=1.0) for name in SOLES]
    wanted = [
        (
            instant.stance,
            np.array(instant.target.com),
            pin.SE3(instant.target.torso_rotation, np.zeros(3)),
            instant.foot_places(),
        )
        for instant in reference.instants[1:]
    ]
    limits: list[Any] | None = None if limited else []
    seconds, postures = [], []
    for stance, com_place, torso_place, places in wanted:
        begun = time.perf_counter()
        com.set_target(com_place)
        torso.set_target(torso_place)
        for task, place in zip(feet, places, strict=True):
            task.set_target(place)
        velocity = pink.solve_ik(
            configuration,
            (com, torso, feet[stance.other]),
            DT,
            solver=solver,
            damping=PINK_DAMPING,
            limits=limits,
            constraints=(feet[stance],),
        )
        configuration.integrate_inplace(velocity, DT)
        seconds.append(time.perf_counter() - begun)
        postures.append(configuration.q)
    return Replay(np.array(seconds), np.array(postures), f"quadratic programs by {solver}")


@cache
def fastest_qp_solver(limited: bool) -> str:
    """Return the one of the installed solvers with which Pink is fastest."""
    import qpsolvers
    from pink.exceptions import NoSolutionFound

    whole = walk_reference()
    part = WalkReference(whole.start, whole.instants[:200])
    medians: dict[str, float] = {}
    for name in qpsolvers.available_solvers:
        try:
            medians[name] = float(np.median(replay_pink(part, limited, name).seconds))
        except (NoSolutionFound, qpsolvers.exceptions.QPError):
            continue
    return min(medians, key=lambda name: medians[name])


def replay_placo(reference: WalkReference) -> Replay:
    """Follow the walk by PlaCo in its own environment.

    Raises:
        RuntimeError: if it fails there; the message holds what it said.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "robot.urdf").write_text(build_urdf(legs()))
        later = reference.instants[1:]
        places = [instant.foot_places() for instant in later]
        np.savez(
            Path(folder) / "reference.npz",
            names=np.array(LEG_JOINTS),
            soles=np.array(SOLES),
            base=frames.BASE_LINK,
            dt=DT,
            start_base=pin.XYZQUATToSE3(reference.start[:7]).homogeneous,
            start_joints=reference.start[7:],
            stances=np.array([int(instant.stance) for instant in later]),
            coms=np.array([instant.target.com for instant in later]),
            torsos=np.array([instant.target.torso_rotation for instant in later]),
            feet=np.array([[place.homogeneous for place in both] for both in places]),
        )
        command = [str(PLACO_ENVIRONMENT / "bin" / "python"), clik_placo.__file__, folder]
        done = subprocess.run(command, capture_output=True, text=True, env={})
        if done.returncode != 0:
            raise RuntimeError(f"PlaCo failed: {done.stderr.strip()[-500:]}")
        result = np.load(Path(folder) / "result.npz")
        bases = [pin.SE3ToXYZQUAT(pin.SE3(base)) for base in result["bases"]]
        postures = np.hstack([np.array(bases), result["joints"]])
        return Replay(result["seconds"], postures, f"version {result['version']}")


SOLVERS: dict[str, Callable[[WalkReference], Replay]] = {
    "ours": replay_own,
    "ours, dead-beat": partial(replay_own, dead_beat=True),
    "Pink": partial(replay_pink, limited=False),
    "Pink with limits": partial(replay_pink, limited=True),
    "PlaCo": replay_placo,
}


def prepare(say: Callable[[str], None]) -> None:
    """See to it that the solvers are there.

    Raises:
        RuntimeError: if one is not and cannot be had.
    """
    if importlib.util.find_spec("pink") is None:
        raise RuntimeError(PINK_MISSING)
    ready = PLACO_ENVIRONMENT / "ready.json"
    if ready.exists() and json.loads(ready.read_text()) == PLACO:
        return
    say(f"Making {PLACO_ENVIRONMENT} for PlaCo, which needs a Pinocchio of its own (once, about a minute)")
    venv.create(PLACO_ENVIRONMENT, clear=True, with_pip=True)
    command = [str(PLACO_ENVIRONMENT / "bin" / "python"), "-m", "pip", "install", "--no-input", "--quiet", PLACO]
    done = subprocess.run(command, stdout=sys.stderr, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"PlaCo cannot be installed: {done.stderr.strip()[-500:]}")
    ready.write_text(json.dumps(PLACO))
