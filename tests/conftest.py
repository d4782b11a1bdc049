"""Fixtures that several test modules share."""

import numpy as np
import pytest
from hypothesis import settings

import borecheck as bc

# The same examples in every run; studies/fuzz_validate.py is for finding new ones.
settings.register_profile("seeded", derandomize=True, database=None)
settings.load_profile("seeded")


@pytest.fixture
def rng():
    return np.random.default_rng(20260101)


@pytest.fixture(scope="session")
def zerobot():
    return bc.load_robot("zerobot")


@pytest.fixture(scope="session")
def ct_gantry():
    return bc.load_scene("ct_gantry")
