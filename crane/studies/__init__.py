"""What CRANE's mechanics say, one study a module; each prints its numbers."""
