"""The methods that are compared: ablations, baselines and the upper bound."""
