"""IPPON: common-sense guided informative path planning for object goal navigation."""
