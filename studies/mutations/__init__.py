"""Mutations of the code that says `clear`: does a test notice each of them?"""
