"""Finds anybody's body by its name, as in my_package.my_robot:MyRobot."""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import yaml

from tulip_description.robot import Robot
from tulip_driver.contract import Body, BodyError

METHODS = ("start", "exchange", "stop")


def load_class(name: str) -> type[Body]:
    """Return a body's class; any with the three methods will do, whether or not it inherits from `Body`.

    Args:
        name: package.module:Class; the folder that a program is started in is searched, too.

    Raises:
        BodyError: if there is no such module or class, or it is no body.
    """
    module_name, colon, class_name = name.partition(":")
    if not (colon and module_name and class_name):
        raise BodyError(f"Driver is {name!r}; expected package.module:Class, as in tulip_driver.echo:EchoBody.")
    if "" not in sys.path:
        sys.path.append("")
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        hint = "is the name right, and its folder in PYTHONPATH or the present one?"
        own = isinstance(error, ModuleNotFoundError) and error.name is not None
        if own and (module_name == error.name or module_name.startswith(f"{error.name}.")):
            raise BodyError(f"Driver {name}: there is no module {error.name!r}; {hint}") from error
        raise BodyError(f"Driver {name}: its module cannot be imported: {error}.") from error
    found = getattr(module, class_name, None)
    classes = sorted(each for each, value in vars(module).items() if _is_body(value))
    if not inspect.isclass(found):
        raise BodyError(
            f"Driver {name}: module {module_name} has no class {class_name!r}. Bodies in it: "
            f"{', '.join(classes) or 'none'}."
        )
    missing = [method for method in METHODS if not callable(getattr(found, method, None))]
    missing += sorted(set(getattr(found, "__abstractmethods__", ())) - set(missing))
    if missing:
        raise BodyError(
            f"Driver {name}: class {class_name} lacks {', '.join(missing)}; expected start(), exchange(command) and "
            "stop(), see docs/hardware.md."
        )
    return cast(type[Body], found)


def make_body(name: str, robot: Robot, options: Mapping[str, Any]) -> Body:
    """Make a body: the class of that name, with the robot and options.

    Raises:
        BodyError: if the class cannot be found, or does not take the options.
    """
    found: Callable[..., Body] = load_class(name)
    try:
        inspect.signature(found).bind(robot, **options)
    except TypeError as error:
        taken = list(inspect.signature(found).parameters)[1:]
        raise BodyError(
            f"Driver {name} does not take these options: {error}. It is called with the robot, and takes: "
            f"{', '.join(taken) or 'no options'}."
        ) from error
    try:
        return found(robot, **options)
    except (ValueError, TypeError) as error:
        raise BodyError(f"Driver {name}: {error}") from error


def read_options(given: Sequence[str]) -> dict[str, Any]:
    """Return options as values by name, each given as name=value, the value in YAML as in port=4747.

    Raises:
        BodyError: if one is not of that form.
    """
    options: dict[str, Any] = {}
    for each in given:
        name, sign, value = each.partition("=")
        if not (sign and name.isidentifier()):
            raise BodyError(f"Option of the driver is {each!r}; expected name=value, as in port=4747.")
        try:
            options[name] = yaml.safe_load(value)
        except yaml.YAMLError as error:
            raise BodyError(f"Option {name} of the driver is {value!r}; expected a value as in YAML.") from error
    return options


def flag(body: Body, name: str) -> bool:
    """Return one of the contract's flags, also of a class that does not inherit from `Body`."""
    return bool(getattr(body, name, getattr(Body, name)))


def _is_body(value: object) -> bool:
    return (
        inspect.isclass(value)
        and not inspect.isabstract(value)
        and all(callable(getattr(value, name, None)) for name in METHODS)
    )
