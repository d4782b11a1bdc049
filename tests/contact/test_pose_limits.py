"""Limits as kernels take them: what the model's own question says, at every border."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.contact.pose_kernel import _is_within
from borecheck.contact.pose_limits import limits_of
from borecheck.robots.model import LIMIT_TOLERANCE
from tests.places import ROBOTS

SHARES = (-2.0, -0.5, 0.0, 0.5, 2.0)  # of the tolerance, beyond a limit


@pytest.mark.parametrize("name", ["zerobot", "mri_arm", str(ROBOTS / "two_link.urdf")])
@pytest.mark.parametrize("end", [-1.0, 1.0])
def test_a_joint_may_stand_at_its_limit_and_not_beyond(name, end):
    robot = bc.load_robot(name)
    limits, model = limits_of(robot), robot.model
    ends = model.upper if end > 0.0 else model.lower
    assert np.isfinite(ends).any()
    for k in np.flatnonzero(np.isfinite(ends)):
        qs = np.tile(robot.home, (len(SHARES), 1))
        qs[:, k] = ends[k] + end * LIMIT_TOLERANCE * np.array(SHARES)
        within = [_is_within.py_func(qs, i, limits) for i in range(len(qs))]
        assert within == [True, True, True, True, False]
        assert within == list(~model.beyond_limits(qs))
