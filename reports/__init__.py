"""Reports: files that compute, check and write one page each; ``daebench list reports`` names them."""
