"""Common parts of every linked kernel: the scheme language, Newton's iteration, the loop over steps, and composed functions."""
