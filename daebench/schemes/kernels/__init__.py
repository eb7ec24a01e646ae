"""What every linked kernel shares: the hole, Newton's iteration, the loop over steps, and functions composed of a problem's own."""
