"""Data: what is found where. Read by `ippon.guidance.knowledge`."""
