"""The body file: what is written is read again, what is wrong is refused, and motion control uses it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.body_file import Body, BodyFileError, BodySource, links_of, read_body, write_body
from tulip_description.robot import load_robot
from tulip_motion.learning_file import belongs_to
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.secret_body import secret_body

ROBOT = load_robot()


def body_of(seed: int) -> Body:
    """Return a body with random links and base parameters."""
    rng = np.random.default_rng(seed)
    factor = 1e-6 * rng.standard_normal((3, 3))
    return Body(
        variant="playing",
        source=BodySource("recordings/static: 1 # left", "2013-06-24", 40),
        links=links_of(secret_body(ROBOT, rng).links),
        base_names=("m c_x(base_link) + 0.085 m(left_hip_motor and below)", "m c_z(head)", "m(base_link) + m(neck)"),
        base_values=rng.standard_normal(3),
        base_covariance=factor @ factor.T,
        model_error=2e-4,
    )


@given(seed=st.integers(0, 2**32 - 1))
def test_a_body_is_read_as_it_was_written_to_the_last_digit(tmp_path_factory: Any, seed: int) -> None:
    path, body = tmp_path_factory.mktemp("body") / "new" / "body.yaml", body_of(seed)
    write_body(path, body)
    found = read_body(path)
    assert (found.variant, found.source, found.links) == (body.variant, body.source, body.links)
    assert found.base_names == body.base_names
    assert np.array_equal(found.base_values, body.base_values)
    assert np.array_equal(found.base_covariance, body.base_covariance)
    assert [file.name for file in path.parent.iterdir()] == ["body.yaml"]


def test_load_robot_takes_the_bodys_masses_and_keeps_the_rest(tmp_path: Path) -> None:
    truth, path = secret_body(ROBOT, np.random.default_rng(1)), tmp_path / "body.yaml"
    write_body(path, replace(body_of(1), links=links_of(truth.links)))
    assert load_robot(body=path) == truth
    assert load_robot() == ROBOT


def test_motion_control_reckons_with_the_body_of_its_file(tmp_path: Path) -> None:
    truth, path = secret_body(ROBOT, np.random.default_rng(1)), tmp_path / "body.yaml"
    write_body(path, replace(body_of(1), links=links_of(truth.links)))
    parameters = MotionParameters(body_file=str(path))
    told, knows = Motion(parameters, ROBOT), Motion(MotionParameters(), truth)
    assert told._estimator._model == knows._estimator._model
    assert told._estimator._model != Motion(MotionParameters(), ROBOT)._estimator._model


def test_learned_torques_belong_to_the_body_not_to_the_name_of_its_file() -> None:
    plain, named = MotionParameters(), MotionParameters(body_file="body.yaml")
    assert belongs_to(plain, ROBOT) == belongs_to(named, ROBOT)
    assert belongs_to(plain, ROBOT) != belongs_to(plain, secret_body(ROBOT, np.random.default_rng(1)))


def test_a_file_that_is_not_there_is_refused_by_motion_control() -> None:
    with pytest.raises(ValueError, match=r"nowhere\.yaml cannot be read: No such file"):
        Motion(MotionParameters(body_file="nowhere.yaml"), ROBOT)


def test_a_body_of_another_variant_is_refused() -> None:
    with pytest.raises(BodyFileError, match=r"the body is of a robot playing with links .* expected table with"):
        body_of(0).on(load_robot("table"))


def _set(*keys: str | int, value: Any) -> Callable[[Any], None]:
    def change(data: Any) -> None:
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_set("version", value=2), "version is 2; expected 1"),
        (lambda data: data.pop("variant"), "the file: variant is missing"),
        (_set("links", value=[]), r"links is \[\]; expected a mapping"),
        (_set("links", "neck", "mass", value="1 kg"), "links, neck: mass is '1 kg'; expected a number"),
        (_set("links", "neck", "mass", value=-0.2), "links, neck: its mass is -0.2 kg; expected > 0"),
        (_set("links", "neck", "com", value=[0, 1]), r"links, neck: com is \[0, 1\]; expected 3 numbers"),
        (_set("links", "neck", "com", value=[0, 1, float("nan")]), "links, neck: com is .* expected 3 numbers"),
        (_set("links", "neck", "inertia", value=[9.0, 1.0, 1.0]), "links, neck: its pseudo-inertia is not positive"),
        (_set("source", "date", value="yesterday"), "source: date is 'yesterday'; expected as in 2013-06-24"),
        (_set("source", "postures", value=-1), "source: postures is -1; expected a count"),
        (_set("base_covariance", 0, 1, value=1e-9), "base_covariance is not symmetric and positive semidefinite"),
        (_set("base_covariance", value=[]), "are expected to be lists of one length"),
        (_set("base_parameters", 0, "value", value=None), "base_parameters: value is None; expected a number"),
    ],
)
def test_what_is_wrong_in_a_file_is_said(tmp_path: Path, change: Callable[[Any], None], message: str) -> None:
    path = tmp_path / "body.yaml"
    write_body(path, body_of(0))
    data = yaml.safe_load(path.read_text())
    change(data)
    path.write_text(yaml.safe_dump(data))
    with pytest.raises(BodyFileError, match=message) as caught:
        read_body(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(("text", "message"), [("[", "is not YAML"), ("1", "the file is 1; expected a mapping")])
def test_files_of_another_kind_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "body.yaml"
    path.write_text(text)
    with pytest.raises(BodyFileError, match=message):
        read_body(path)


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BodyFileError, match=r"body\.yaml cannot be written: "):
        write_body(tmp_path / "file" / "body.yaml", body_of(0))
