"""The checks themselves, one module a subject; each is a function with a code."""
