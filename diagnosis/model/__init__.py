"""The linear model that sets of effects are weighed in: columns with priors, a smooth unknown, coloured noise."""
