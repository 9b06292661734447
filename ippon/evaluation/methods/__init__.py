"""Methods that are compared: ablations, baselines and the upper bound."""
