"""Child processes, signals and the cache of compiled kernels."""
