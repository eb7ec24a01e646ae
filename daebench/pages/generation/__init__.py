"""An integrator as code of one's own: a scheme on a problem as sources in C, with what is needed to compile, to test and to use them."""
