"""How kernels are compiled and kept; imported before any of them."""
