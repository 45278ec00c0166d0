"""What a lockstep recording says about itself: the same as a graph's, with settings as the nodes would have them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_ros import log_notes
from tulip_ros.log_notes import Notebook
from tulip_sim.lockstep import Settings
from tulip_sim.match_places import in_map_of
from tulip_sim.match_referee import MatchReferee
from tulip_sim.match_rules import NAMESPACES, TEAMS
from tulip_sim.match_settings import MatchSettings
from tulip_sim.parameters import WorldParameters
from tulip_sim.perception import PerceptionParameters
from tulip_sim.robot_stack import RobotSettings

OWN = {"mode": "lockstep", "time": "simulated, in ns"}


def explain_trial(
    bag: Notebook, seed: int, scenario: str, start: Pose2D, settings: Settings | None, strategy: str
) -> None:
    """Note how a trial is played.

    Args:
        bag: A recording that was begun.
        seed: Of the scenario and of all noise.
        scenario: Its name.
        start: Where the robot is told to stand.
        settings: Parameters of everything.
        strategy: What the robot plays.

    Raises:
        OSError: if the recording cannot be written.
    """
    settings = settings or Settings()
    log_notes.explain(bag, {**OWN, "seed": str(seed), "scenario": scenario, "strategy": strategy, "robots": "1"})
    _attach_robot(bag, "", settings, {"start_x": start.x, "start_y": start.y, "start_yaw": start.yaw}, {})
    log_notes.attach_parameters(bag, "user_input", {"autostart": True, "strategy": strategy})
    driver = {"scenario": scenario, "rules": settings.referee}
    _attach_driver(bag, "driver", seed, settings.world, settings, driver)


def explain_match(bag: Notebook, seed: int, settings: MatchSettings) -> None:
    """Note how a match is played. Arguments and errors as for `explain_trial`."""
    own = {"seed": str(seed), "striker": settings.striker, "keeper": settings.keeper, "robots": "2"}
    log_notes.explain(bag, {**OWN, **own})
    places, _ = MatchReferee(settings.rules, load_field(), seed).places
    for team in TEAMS:
        turned = {"field_turned": team == 1}
        start = in_map_of(team, places[team])
        told = {"start_x": start.x, "start_y": start.y, "start_yaw": start.yaw}
        _attach_robot(bag, f"{NAMESPACES[team]}/", settings.of_team(team), {**turned, **told}, turned)
    driver = {"striker": settings.striker, "keeper": settings.keeper, "rules": settings.rules}
    _attach_driver(bag, "driver", seed, settings.world, settings.of_team(0), driver)


def explain_experiment(
    bag: Notebook, seed: int, settings: ExperimentSettings, world: WorldParameters, secret: int | None
) -> None:
    """Note how the identification experiment is done.

    Args:
        bag: A recording that was begun.
        seed: Of all noise.
        settings: Of the experiment.
        world: Physics and sensors.
        secret: Seed of the body that the robot really has, or None for the one that it is believed to have.

    Raises:
        OSError: if the recording cannot be written.
    """
    body = {} if secret is None else {"secret_body": str(secret)}
    log_notes.explain(bag, {**OWN, "seed": str(seed), "scenario": "identification", "robots": "1", **body})
    log_notes.attach_settings(bag, "identify", settings)
    log_notes.attach_settings(bag, "driver", None, seed=seed, camera=False, world=world)


def _attach_robot(
    bag: Notebook, prefix: str, settings: RobotSettings, worldmodel: dict[str, Any], strategy: dict[str, Any]
) -> None:
    log_notes.attach_settings(bag, f"{prefix}worldmodel", settings.worldmodel, **worldmodel)
    log_notes.attach_settings(bag, f"{prefix}strategy", settings.strategy, **strategy)
    for name in ("motion", "head", "game_input"):
        log_notes.attach_settings(bag, f"{prefix}{name}", getattr(settings, name))
    if settings.perception is None:
        log_notes.attach_settings(bag, f"{prefix}vision", settings.vision)
    else:
        quality: PerceptionParameters = settings.perception
        values = {f"quality.{name}": value for name, value in asdict(quality).items()}
        log_notes.attach_parameters(bag, f"{prefix}perception", values)


def _attach_driver(
    bag: Notebook, name: str, seed: int, world: WorldParameters, robot: RobotSettings, others: dict[str, Any]
) -> None:
    values: dict[str, Any] = {"seed": seed, "camera": robot.perception is None}
    values.update(world=world, pictures=robot.camera)
    log_notes.attach_settings(bag, name, **values, **others)
