"""The way there: certified paths between configurations.

Others use `route.route` and its record. Every edge of a way is proven by the certified
search of `motion`; what is not proven is no edge.
"""
