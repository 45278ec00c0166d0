"""Which landmark each feature of one picture shows, decided for the whole picture together.

Features are taken one after the other, those with the fewest candidates first. Each hypothesis is a choice for
the features so far (a landmark, or "false"), with the state as it would be after them, so that a later
feature is judged by the joint likelihood. The cost of a choice is -2 ln of its likelihood:

    landmark:  d^2 + ln det(2 pi S) - 2 ln(1 - p_false)      d: Mahalanobis distance of the innovation
    false:     -2 ln(p_false * clutter density)

Only the best few hypotheses are kept. A choice counts only if every hypothesis with another choice for that
feature is clearly worse.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tulip_vision.features import Feature
from tulip_worldmodel.mahalanobis import distances_and_determinants, gate

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

FALSE = -1
WIDTH = 12  # hypotheses kept; the true one is among the first two or three in practice


class Observation(Protocol):
    """A feature with its candidates, numbered from 0."""

    feature: Feature

    def key(self, candidate: int) -> object:
        """Return the identity of what only one feature of a picture can show, or None."""

    def possible(self, state: Array) -> Indices:
        """Return the candidates that are possible at all near a state."""

    def linearize(self, state: Array, candidates: Indices) -> tuple[Array, Array, Array]:
        """Return innovations (k, m), Jacobians (k, m, n) and noise (k, m, m)."""


@dataclass(frozen=True)
class Choice:
    """What was decided for one feature.

    Attributes:
        observation: Index of the observation.
        candidate: The chosen candidate, or None when the feature is rejected.
        reason: Why it was rejected, or "".
        ambiguous: Rejected only because it may be one of several.
    """

    observation: int
    candidate: int | None
    reason: str = ""
    ambiguous: bool = False


@dataclass(frozen=True)
class Association:
    """What was decided for a picture.

    Attributes:
        choices: One an observation, in their order.
        log_likelihood: Of all observations, with the best choices.
        nearest: For each observation, the squared Mahalanobis distance of the nearest candidate and its dimension;
            infinite where none is possible.
    """

    choices: tuple[Choice, ...]
    log_likelihood: float
    nearest: tuple[tuple[float, int], ...]


@dataclass(frozen=True)
class _Linearized:
    observation: int
    candidates: tuple[int, ...]
    keys: tuple[object, ...]
    innovations: Array
    jacobians: Array
    noises: Array
    gate: float
    cost_true: float
    cost_false: float


class _Hypothesis(NamedTuple):
    """Choices for the features so far, and the state after them as an offset from the prior."""

    cost: float
    state: Array
    covariance: Array
    choices: tuple[int, ...]
    taken: frozenset[object]


class _Child(NamedTuple):
    """A hypothesis continued with one choice: a position among the feature's candidates, or FALSE."""

    cost: float
    parent: _Hypothesis
    position: int


def associate(
    state: Array,
    covariance: Array,
    observations: Sequence[Observation],
    false_rates: Sequence[float],
    clutter: Sequence[float],
    gate_probability: float,
    odds: float,
) -> Association:
    """Decide for each observation which candidate it shows.

    Args:
        state: (n,) prior state.
        covariance: (n, n) its covariance.
        observations: Of one picture.
        false_rates: For each, the probability that it shows nothing that is a candidate.
        clutter: For each, the density of false ones in its measurement space.
        gate_probability: Share of true observations that the chi-square gate lets pass.
        odds: How much more likely than any other choice the best one must be.
    """
    rejected: dict[int, str] = {}
    outside = 0.0  # cost of the features without any candidate
    usable: list[_Linearized] = []
    nearest = [(math.inf, 2)] * len(observations)
    for index, observation in enumerate(observations):
        possible = observation.possible(state)
        near = np.empty(0, dtype=np.intp)
        if len(possible):
            innovations, jacobians, noises = observation.linearize(state, possible)
            spreads = jacobians @ covariance @ jacobians.transpose(0, 2, 1) + noises
            distances, _ = distances_and_determinants(innovations, spreads)
            dimension = innovations.shape[1]
            nearest[index] = float(distances.min()), dimension
            near = np.flatnonzero(distances <= gate(gate_probability, dimension))
        if not len(near):
            rejected[index] = "no landmark inside the gate"
            outside += -2.0 * math.log(false_rates[index] * clutter[index])
            continue
        candidates = possible[near].tolist()
        usable.append(
            _Linearized(
                index,
                tuple(candidates),
                tuple(observation.key(candidate) for candidate in candidates),
                innovations[near],
                jacobians[near],
                noises[near],
                gate(gate_probability, dimension),
                dimension * math.log(2.0 * math.pi) - 2.0 * math.log(1.0 - false_rates[index]),
                -2.0 * math.log(false_rates[index] * clutter[index]),
            )
        )
    usable.sort(key=lambda item: (len(item.candidates), float(item.noises[0].trace())))
    gap = 2.0 * math.log(odds)
    hypotheses = [_Hypothesis(0.0, np.zeros_like(state), covariance, (), frozenset())]
    for item in usable:
        children = [child for parent in hypotheses for child in _children(parent, item)]
        children.sort(key=lambda child: child.cost)
        limit = children[0].cost + 2.0 * gap  # later features may turn the order, not by more than this in practice
        hypotheses = [_grown(child, item) for child in children[:WIDTH] if child.cost <= limit]
    choices = _verdicts(len(observations), usable, hypotheses, rejected, gap)
    return Association(choices, -0.5 * (hypotheses[0].cost + outside), tuple(nearest))


def _children(parent: _Hypothesis, item: _Linearized) -> list[_Child]:
    """Continue one hypothesis with every choice for one feature."""
    jacobians = item.jacobians
    innovations = item.innovations - jacobians @ parent.state
    spreads = jacobians @ parent.covariance @ jacobians.transpose(0, 2, 1) + item.noises
    distances, determinants = distances_and_determinants(innovations, spreads)
    costs = distances + np.log(determinants) + (parent.cost + item.cost_true)
    children = [_Child(parent.cost + item.cost_false, parent, FALSE)]
    for position, (cost, distance) in enumerate(zip(costs.tolist(), distances.tolist(), strict=True)):
        key = item.keys[position]
        if distance <= item.gate and (key is None or key not in parent.taken):
            children.append(_Child(cost, parent, position))
    return children


def _grown(child: _Child, item: _Linearized) -> _Hypothesis:
    """Return the hypothesis that a child stands for, with the state corrected by its choice."""
    parent, position = child.parent, child.position
    if position == FALSE:
        return _Hypothesis(child.cost, parent.state, parent.covariance, (*parent.choices, FALSE), parent.taken)
    jacobian, key = item.jacobians[position], item.keys[position]
    gain_part = parent.covariance @ jacobian.T
    gain = gain_part @ np.linalg.inv(jacobian @ gain_part + item.noises[position])
    return _Hypothesis(
        child.cost,
        parent.state + gain @ (item.innovations[position] - jacobian @ parent.state),
        parent.covariance - gain @ gain_part.T,
        (*parent.choices, item.candidates[position]),
        parent.taken if key is None else parent.taken | {key},
    )


def _verdicts(
    count: int, usable: list[_Linearized], hypotheses: list[_Hypothesis], rejected: dict[int, str], gap: float
) -> tuple[Choice, ...]:
    best = hypotheses[0]
    chosen: dict[int, int] = {}
    ambiguous: set[int] = set()
    for position, item in enumerate(usable):
        choice = best.choices[position]
        others = [other.cost for other in hypotheses[1:] if other.choices[position] != choice]
        if choice == FALSE:
            rejected[item.observation] = "more likely false than any landmark inside the gate"
        elif others and min(others) - best.cost < gap:
            rejected[item.observation] = "ambiguous: another explanation is about as likely"
            ambiguous.add(item.observation)
        else:
            chosen[item.observation] = choice
    return tuple(
        Choice(index, chosen[index]) if index in chosen else Choice(index, None, rejected[index], index in ambiguous)
        for index in range(count)
    )
