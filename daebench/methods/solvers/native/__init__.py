"""IDA and CVODE with compiled callbacks: what they call is machine code, and so is the loop over their steps."""
