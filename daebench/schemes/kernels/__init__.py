"""What every linked kernel shares: the scheme language, Newton's iteration, the loop over steps, and functions composed of others."""
