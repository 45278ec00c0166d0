"""Dynamic identification of robots that were secretly changed: ZMP, CoM and joint friction, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import SIDES, Robot, load_robot
from tulip_description.short_numbers import significant
from tulip_motion.identification.dynamic_identification import (
    Combination,
    DynamicIdentification,
    base_combinations,
    com_error,
    dynamic_prior,
    identify_dynamics,
    knowledge,
    static_covariance,
)
from tulip_motion.identification.exciting_motions import LEANS, SQUATS, SWAYS, leg_swing
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.joint_friction import identify_friction
from tulip_motion.identification.motion_log import MotionLog
from tulip_motion.identification.static_postures import PostureSolver
from tulip_motion.identification.zmp_regressor import ZmpRegressor, parameters_of
from tulip_motion.identification.zmp_rows import ZmpRows, zmp_rows
from tulip_motion.interface import Side
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.excited_log import START, excited_log, walking_log
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.secret_body import secret_body
from tulip_sim.world import World

Array = NDArray[np.float64]

SEEDS = 5
WORLD = WorldParameters(mass_spread=0.0)  # the secret body is the whole change; sensors, friction and delay as ever
WALKS = {"walk": (0.2, 0.0, 0.0), "turning walk": (0.15, 0.1, 0.4)}
WALK_TIME = 10.0  # [s]
TESTED = ("squats", "sways", "walk", "turning walk")
WALKING = ("walk", "turning walk")
POSTURES = 200
STATIC_POSTURES = 40
STATIC_ERROR = 0.5e-3  # [m] of the CoP of a posture at rest: noise of a second, and what the model leaves over
SPEED = 1.0  # [rad/s] at which friction is compared
FRICTION_LOGS = ("left leg stands", "right leg stands")


def bodies(seed: int) -> tuple[Robot, Robot]:
    """Return a robot as it is and as it is believed to be."""
    believed = load_robot()
    return secret_body(believed, np.random.default_rng([seed, 7])), believed


def recordings(seed: int) -> dict[str, MotionLog]:
    """Return logs of all motions of one secretly changed robot."""
    true, believed = bodies(seed)
    motions = {
        "squats": SQUATS,
        "sways": SWAYS,
        "leans": LEANS,
        FRICTION_LOGS[0]: leg_swing(Side.LEFT),
        FRICTION_LOGS[1]: leg_swing(Side.RIGHT),
    }
    logs = {name: excited_log(motion, true, believed, seed, WORLD) for name, motion in motions.items()}
    for name, velocity in WALKS.items():
        logs[name] = walking_log(velocity, WALK_TIME, true, believed, seed, WORLD)
    return logs


def identified_without(regressor: ZmpRegressor, rows: dict[str, ZmpRows], tested: str) -> DynamicIdentification:
    """Return what the other motions tell; no walk tells of a walk."""
    left_out = WALKING if tested in WALKING else (tested,)
    return identify_dynamics(regressor, [rows[name] for name in rows if name not in left_out])


def true_parameters(true: Robot) -> Array:
    """Return (10 b + 3,) parameters of a robot, and of cells whose sole carries on its rim."""
    foot = true.feet[0]
    (heel, inner), (toe, outer) = foot.cells[0], foot.cells[3]
    length, width = (foot.x[1] - foot.x[0]) / (toe - heel), (foot.y[1] - foot.y[0]) / abs(outer - inner)
    return np.concatenate([parameters_of(floating_model(true)), [length - 1.0, width - 1.0, 0.0]])


def measure(seed: int) -> Row:
    """Identify one robot."""
    true, believed = bodies(seed)
    regressor, logs = ZmpRegressor(believed), recordings(seed)
    rows = {name: zmp_rows(regressor, log) for name, log in logs.items()}
    row: Row = {"seed": seed}
    for name in TESTED:
        found = identified_without(regressor, rows, name)
        for model, parameters in (
            ("wrong", dynamic_prior(believed).mean),
            ("identified", found.all_parameters),
            ("true", true_parameters(true)),
        ):
            row[f"ZMP {name}, {model} [mm]"] = _rms(rows[name].error(parameters))
    found = identify_dynamics(regressor, list(rows.values()))
    postures = unseen_postures(true, seed)
    truth = floating_model(true)
    before = com_error(floating_model(believed), truth, postures)
    after = com_error(found.model(), truth, postures)
    for axis, letter in enumerate("xyz"):
        row[f"CoM {letter} [mm]"] = [_rms(before[:, axis : axis + 1]), _rms(after[:, axis : axis + 1])]
    row["CoM x and y [mm]"] = [_rms(before[:, :2]), _rms(after[:, :2])]
    mass, deviation = found.mass
    row["mass error [kg]"] = [round(believed.mass - true.mass, 3), round(mass - true.mass, 3), round(deviation, 3)]
    row["combinations learned"] = round(found.fit.learned, 1)
    row["spreads"] = [round(float(spread), 3) for spread in found.cells[:2]]
    row["bodies moved"] = list(found.moved)
    row["deviations"] = _deviations(regressor, found, postures[:STATIC_POSTURES])
    row["friction"] = _friction(regressor, logs, found, seed)
    return row


def unseen_postures(true: Robot, seed: int) -> list[tuple[int, Array]]:
    """Return postures that the robot can hold on one foot, half of them on each."""
    rng, start = np.random.default_rng([seed, 8]), standing_posture(true).joint_positions
    found: list[tuple[int, Array]] = []
    for samples in zip(*(PostureSolver(true, side).samples(rng, start) for side in ("left", "right")), strict=True):
        found += [(foot, sample.joint_positions) for foot, sample in enumerate(samples)]
        if len(found) >= POSTURES:
            return found
    raise AssertionError("samples do not end")


def _deviations(
    regressor: ZmpRegressor, found: DynamicIdentification, postures: Sequence[tuple[int, Array]]
) -> dict[str, list[float]]:
    """Return of each combination the standard deviation by prior, by static postures, and after the motions."""
    prior = inertial_prior(regressor.robot)
    combinations = base_combinations(regressor.robot)
    static = static_covariance(regressor, postures, prior, STATIC_ERROR)
    columns = [knowledge(combinations, covariance) for covariance in (prior.covariance, static, found.covariance)]
    table = np.stack(columns, axis=1)
    return {c.name: significant(row).tolist() for c, row in zip(combinations, table, strict=True)}


def _friction(
    regressor: ZmpRegressor, logs: dict[str, MotionLog], found: DynamicIdentification, seed: int
) -> dict[str, list[float]]:
    """Return of each joint the true friction at `SPEED`, the one found, and its standard deviation [N m]."""
    world = World(Scenario(robot=START, ball=(0.0, -2.5), poles=False), WORLD, seed)
    true = world.robots[0].dry_friction * np.tanh(SPEED / WORLD.joint_friction_speed)
    world.close()
    result = identify_friction(regressor, [logs[name] for name in FRICTION_LOGS], found.prior)
    table = {}
    for joint, name in enumerate(regressor.robot.joint_names):
        if name in result.joints:
            torque, deviation = result.joints[name].torque(SPEED, result.coulomb_speed)
            table[name] = [round(float(value), 4) for value in (true[joint], torque, deviation)]
    return table


def _rms(errors: Array) -> float:
    """Return the root mean square length of errors (t, k) [m], in mm."""
    return round(1e3 * float(np.sqrt((errors**2).sum(axis=1).mean())), 2)


def summarize(rows: list[Row]) -> list[str]:
    """Return tables."""
    lines = [
        f"{len(rows)} robots whose link masses (+-20 %) and CoMs (+-2 cm on each axis) were secretly changed. Squats,"
        f" sways, leans, a swing of each leg, and two walks of {WALK_TIME:.0f} s; sensors with noise. ZMP: root mean"
        " square distance to the measured CoP, predicted by the wrong model, by the one identified from the *other*"
        " motions (for walks: from none), and by the true one, which is the floor.",
        "",
        "| motion | wrong model | identified | true |",
        "| --- | --- | --- | --- |",
    ]
    for name in TESTED:
        models = ("wrong", "identified", "true")
        cells = [_range([row[f"ZMP {name}, {model} [mm]"] for row in rows]) for model in models]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    lines += [
        "",
        f"CoM of {POSTURES} unseen postures on one foot, in the sole frame, by the model identified from all motions:",
        "",
        "| | robot file | identified |",
        "| --- | --- | --- |",
    ]
    for name in ("CoM x [mm]", "CoM y [mm]", "CoM z [mm]", "CoM x and y [mm]"):
        before, after = zip(*(row[name] for row in rows), strict=True)
        lines.append(f"| {name[:-5]} | {_range(before)} | {_range(after)} |")
    masses = [row["mass error [kg]"] for row in rows]
    of_file, found = [abs(mass[0]) for mass in masses], [1e3 * abs(mass[1]) for mass in masses]
    lines += [
        f"| mass | {min(of_file):.2f}-{max(of_file):.2f} kg | {min(found):.0f}-{max(found):.0f} g |",
        "",
        *_learned(rows),
        "",
        f"Friction of the leg joints at {SPEED:.0f} rad/s, from the legs' swings; left and right leg of all robots:",
        "",
        "| joint | true | error, root mean square | stated |",
        "| --- | --- | --- | --- |",
    ]
    parts = dict.fromkeys(name.split("_", 1)[1] for row in rows for name in row["friction"])
    for part in parts:
        legs = [row["friction"].get(f"{side}_{part}") for row in rows for side in SIDES]
        table = np.array([leg for leg in legs if leg is not None])
        error, stated = (np.sqrt((values**2).mean()) for values in (table[:, 1] - table[:, 0], table[:, 2]))
        lines.append(
            f"| {part.replace('_', ' ')} | {table[:, 0].min():.3f}-{table[:, 0].max():.3f} N m | {error:.3f} N m"
            f" | {stated:.3f} N m |"
        )
    return lines


def _learned(rows: list[Row]) -> list[str]:
    """Return which combinations static postures and motions tell: those known twice as well as before."""
    combinations = base_combinations(load_robot())
    deviations = {c.name: np.median([row["deviations"][c.name] for row in rows], axis=0) for c in combinations}
    by_static = [c for c in combinations if deviations[c.name][1] < 0.5 * deviations[c.name][0]]
    by_motion = [c for c in combinations if deviations[c.name][2] < 0.5 * deviations[c.name][0]]
    added = [c for c in by_motion if c not in by_static]
    missed = [c for c in by_static if c not in by_motion]
    static = sum(c.static for c in combinations)
    return [
        f"The ZMP equation has {len(combinations)} independent combinations of parameters, of which {static} show at"
        f" rest. {STATIC_POSTURES} postures at rest ({1e3 * STATIC_ERROR:.1f} mm of error each) halve the doubt, at"
        f" least, of {len(by_static)}; these motions of {len(by_motion)}.",
        f"Told by motion alone: {_names(added)}. Told by the postures alone: {_names(missed)}.",
    ]


def _names(combinations: Sequence[Combination]) -> str:
    return ", ".join(f"`{combination.name}`" for combination in combinations) or "none"


def _range(values: Sequence[float]) -> str:
    return f"{np.mean(values):.1f} mm ({min(values):.1f}-{max(values):.1f})"


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw measured and predicted CoP of the first robot in a squat, a sway and a walk, before and after."""
    seed = int(rows[0]["seed"])
    _, believed = bodies(seed)
    regressor = ZmpRegressor(believed)
    recorded = {name: zmp_rows(regressor, log) for name, log in recordings(seed).items()}
    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    axes = figure.subplots(3, 2, sharex="row")
    for line, (name, begin) in zip(axes, (("squats", 8.0), ("sways", 8.0), ("walk", 4.0)), strict=True):
        found, part = identified_without(regressor, recorded, name), recorded[name]
        shown = (part.times >= begin) & (part.times <= begin + (10.0 if name != "walk" else 4.0))
        for axis, (plot, direction) in enumerate(zip(line, ("forward", "left"), strict=True)):
            plot.plot(part.times[shown], 1e3 * part.cop[shown, axis], "k", linewidth=2.0, label="measured CoP")
            for label, colour, parameters in (
                ("robot file", "tab:red", dynamic_prior(believed).mean),
                ("identified from other motions", "tab:green", found.all_parameters),
            ):
                zmp = 1e3 * part.zmp(parameters)[shown, axis]
                plot.plot(part.times[shown], zmp, colour, linewidth=1.2, label=label)
            plot.set_ylabel(f"{direction} of the soles' mean [mm]")
            plot.set_title(name)
            plot.grid(alpha=0.3)
    for plot in axes[-1]:
        plot.set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)


BENCH = Bench("dynamics", "Dynamic identification", [(seed,) for seed in range(SEEDS)], measure, summarize, draw)
