"""Robot and scene of all maps: what is made of them once is made once."""

import pytest

import borecheck as bc


@pytest.fixture(scope="session")
def robot():
    return bc.load_robot("zerobot", mount="+90")


@pytest.fixture(scope="session")
def scene():
    return bc.load_scene("ct_gantry")
