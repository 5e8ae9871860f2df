"""Quartiles: what a page says of some times."""

import statistics


def spread(values):
    """Lower quartile, median and upper quartile, to five digits."""
    values = sorted(values)
    if len(values) == 1:
        quartiles = values * 3
    else:
        quartiles = statistics.quantiles(values, n=4, method="inclusive")
    return [float(f"{value:.5g}") for value in quartiles]
