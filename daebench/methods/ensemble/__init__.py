"""Many runs of a fixed-step method at once: several in the lanes of one core's vectors, and these on several cores."""
