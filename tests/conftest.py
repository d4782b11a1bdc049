"""Fixtures that several test modules share."""

import numpy as np
import pytest

import borecheck as bc


@pytest.fixture
def rng():
    return np.random.default_rng(20260101)


@pytest.fixture(scope="session")
def zerobot():
    return bc.load_robot("zerobot")


@pytest.fixture(scope="session")
def ct_gantry():
    return bc.load_scene("ct_gantry")
