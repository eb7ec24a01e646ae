"""What the harness measures (drifts, defects, orders), as pure functions of numbers; each file is one quantity."""
