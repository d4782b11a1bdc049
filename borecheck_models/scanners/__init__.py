"""Scanners and patients: parametric shapes and how they are described."""
