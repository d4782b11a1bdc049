"""Studies of [Heikkila2010]: accuracy, workspace, task, calibration."""
