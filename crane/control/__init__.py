"""CRANE's closed loop in simulation, [CRANE] sections V-C, V-D, VI-B1; numpy only."""
