"""Forged, malformed and honest certificates: what `verify` says of each."""
