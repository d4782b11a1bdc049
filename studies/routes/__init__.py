"""What ways of robots show: found, walled in, the same again, resampled."""
