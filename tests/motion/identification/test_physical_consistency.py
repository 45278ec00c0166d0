"""Bodies that can be, and the most probable one with the base parameters that were identified."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2
from synthetic import Held, com_by_pinocchio, measure

from tulip_description.body_file import BodySource, read_body, write_body
from tulip_description.pseudo_inertia import pseudo_inertia, why_impossible
from tulip_description.robot import VARIANTS, Link, load_robot
from tulip_motion.identification import physical_consistency
from tulip_motion.identification.com_identification import ComIdentification, identify_com
from tulip_motion.identification.com_regressor import standard_parameters
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.physical_consistency import as_body, check_realizable, most_probable_body
from tulip_sim.secret_body import secret_body, table_robot

ROBOT = load_robot()
NUMBERS = st.floats(-1.0, 1.0)


@given(st.floats(0.1, 10.0), st.tuples(NUMBERS, NUMBERS, NUMBERS), st.tuples(*[st.floats(0.01, 1.0)] * 3))
def test_pseudo_inertia_of_six_masses_is_the_sum_of_their_products(
    mass: float, com: tuple[float, float, float], half: tuple[float, float, float]
) -> None:
    arms = [sign * half[axis] * np.eye(3)[axis] for axis in range(3) for sign in (-1.0, 1.0)]
    summed = sum(mass / 6 * np.outer((*(com + arm), 1.0), (*(com + arm), 1.0)) for arm in arms)
    squares = mass / 3 * np.square(half)
    inertia = tuple(float(squares.sum() - square) for square in squares)
    assert pseudo_inertia(mass, com, inertia) == pytest.approx(summed, abs=1e-9)  # type: ignore[arg-type]
    assert why_impossible(mass, com, inertia) == ""  # type: ignore[arg-type]


@given(st.floats(-1.0, 1.0), st.tuples(NUMBERS, NUMBERS, NUMBERS), st.tuples(*[st.floats(-0.1, 1.0)] * 3))
def test_a_body_is_refused_exactly_if_its_pseudo_inertia_is_not_positive_definite(
    mass: float, com: tuple[float, float, float], inertia: tuple[float, float, float]
) -> None:
    smallest = np.linalg.eigvalsh(pseudo_inertia(mass, com, inertia))[0]
    if abs(smallest) > 1e-9:  # nearer, rounding decides
        assert (why_impossible(mass, com, inertia) == "") == (smallest > 0.0)


@pytest.mark.parametrize(
    ("mass", "inertia", "reason"),
    [
        (-0.1, (1.0, 1.0, 1.0), "its mass is -0.1 kg; expected > 0"),
        (1.0, (0.0, 1.0, 1.0), "expected moments > 0"),
        (1.0, (3.0, 1.0, 1.0), "the moment 3 kg m^2 is not less than the sum of the other two, 2 kg m^2"),
        (float("nan"), (1.0, 1.0, 1.0), "expected finite numbers"),
    ],
)
def test_reasons_why_a_body_cannot_be(mass: float, inertia: tuple[float, float, float], reason: str) -> None:
    assert reason in why_impossible(mass, (0.0, 0.0, 0.0), inertia)
    with pytest.raises(IdentificationError, match="no body is like link thigh: "):
        check_realizable([Link("thigh", mass, (0.0, 0.0, 0.0), inertia, ())])


@pytest.mark.parametrize("variant", VARIANTS)
@given(seed=st.integers(0, 2**32 - 1))
def test_secretly_changed_bodies_can_be_and_stay_within_their_bounds(variant: str, seed: int) -> None:
    believed = load_robot(variant)
    truth = secret_body(believed, np.random.default_rng(seed))
    check_realizable(list(truth.links))
    assert truth.joints == believed.joints
    for link, was in zip(truth.links, believed.links, strict=True):
        assert 0.8 <= link.mass / was.mass <= 1.2
        assert np.abs(np.subtract(link.com, was.com)).max() <= 0.02


def test_table_robot_has_the_tables_mass_on_the_playing_robots_chain() -> None:
    assert table_robot().mass == pytest.approx(load_robot("table").mass, abs=0.01)
    assert table_robot().joints == ROBOT.joints


@pytest.fixture(scope="module")
def fit(held: Held) -> ComIdentification:
    """An identification of a robot that was secretly changed."""
    return identify_com(ROBOT, measure(secret_body(ROBOT, np.random.default_rng(3)), held, np.random.default_rng(4)))


def test_most_probable_body_has_the_identified_base_parameters_and_mass_and_can_be(fit: ComIdentification) -> None:
    body = most_probable_body(fit)
    check_realizable(list(body.robot.links))
    assert body.robot.mass == pytest.approx(fit.mass, rel=1e-5)
    unknown = fit.base.unknown
    error = (fit.base.combinations @ standard_parameters(body.robot) - fit.values)[unknown]
    distance = error @ np.linalg.solve(fit.covariance[unknown, unknown], error)
    assert distance == pytest.approx(body.misfit, abs=1e-2)
    assert distance < chi2.ppf(0.5, len(error))


def test_com_of_the_most_probable_body_is_that_of_the_truth_in_unseen_postures(
    fit: ComIdentification, unseen: Held
) -> None:
    truth, robot = secret_body(ROBOT, np.random.default_rng(3)), most_probable_body(fit).robot
    errors = [com_by_pinocchio(robot, *each)[:2] - com_by_pinocchio(truth, *each)[:2] for each in unseen]
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 5e-4  # [m]


def test_body_file_of_an_identification_gives_its_whole_body_to_any_robot_of_the_variant(
    fit: ComIdentification, tmp_path: Path
) -> None:
    whole, path = most_probable_body(fit), tmp_path / "body.yaml"
    write_body(path, as_body(fit, whole, BodySource("static.mcap", "2013-06-24", fit.postures)))
    assert load_robot(body=path) == whole.robot
    found = read_body(path)
    assert found.base_names == fit.base.names and np.array_equal(found.base_covariance, fit.covariance)


def test_inertias_are_scaled_by_the_masses(fit: ComIdentification) -> None:
    for link, was in zip(most_probable_body(fit).robot.links, ROBOT.links, strict=True):
        assert np.divide(link.inertia, was.inertia) == pytest.approx(np.full(3, link.mass / was.mass))


def test_what_the_postures_do_not_tell_is_the_priors(fit: ComIdentification) -> None:
    body = most_probable_body(fit)
    assert ((body.told > -1e-9) & (body.told < 1.0)).all()
    place = {link.name: index for index, link in enumerate(ROBOT.links)}
    # Where the mass of a hip motor lies along the yaw axis shows in no posture beside the trunk's; of a thigh, it does.
    assert body.told[place["left_hip_motor"], 3] < 0.01
    assert body.told[place["left_thigh"], 1] > 0.9
    assert body.robot.link("left_hip_motor").com[2] == pytest.approx(ROBOT.link("left_hip_motor").com[2], abs=5e-3)


def test_base_parameters_of_the_robot_file_give_back_the_robot_file(fit: ComIdentification) -> None:
    values = fit.base.combinations @ standard_parameters(ROBOT)
    body = most_probable_body(replace(fit, values=values, mass=ROBOT.mass))
    for link, was in zip(body.robot.links, ROBOT.links, strict=True):
        assert link.mass == pytest.approx(was.mass, rel=1e-6)
        assert link.com == pytest.approx(was.com, abs=1e-7)


def _lighter_foot(fit: ComIdentification, mass: float) -> ComIdentification:
    """Return an identification of the robot file with the left foot lighter by a mass [kg] and its moments the same."""
    theta = standard_parameters(ROBOT)
    theta[4 * [link.name for link in ROBOT.links].index("left_foot")] -= mass / ROBOT.mass
    theta[0] += mass / ROBOT.mass
    return replace(fit, values=fit.base.combinations @ theta, mass=ROBOT.mass)


def test_no_link_becomes_lighter_than_allowed_and_the_base_parameters_still_fit(
    fit: ComIdentification, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = _lighter_foot(fit, 0.5)
    light = most_probable_body(wanted).robot.link("left_foot").mass
    least = 0.7 * ROBOT.link("left_foot").mass
    assert light < least
    monkeypatch.setattr(physical_consistency, "LIGHTEST", 0.7)
    body = most_probable_body(wanted)
    assert body.robot.link("left_foot").mass == pytest.approx(least)
    assert body.misfit < chi2.ppf(0.5, len(fit.base.names) - 1)


def test_base_parameters_that_put_a_com_far_off_its_link_are_refused(fit: ComIdentification) -> None:
    with pytest.raises(
        IdentificationError, match=r"put the CoM of left_shank \d\.\d\d m from where the robot file has it"
    ):
        most_probable_body(_lighter_foot(fit, 1.4))


def test_base_parameters_that_no_positive_masses_have_are_refused(fit: ComIdentification) -> None:
    impossible = standard_parameters(ROBOT)
    for index, link in enumerate(ROBOT.links):
        if "thigh" in link.name or "shank" in link.name:
            impossible[4 * index : 4 * index + 4] *= -3.0
    impossible[0] += 1.0 - impossible[::4].sum()
    with pytest.raises(IdentificationError, match="no body with positive masses"):
        most_probable_body(replace(fit, values=fit.base.combinations @ impossible))
