"""A robot profile for `ippon navigate --profile scout`."""

from pathlib import Path

PROFILE = Path(__file__).with_name("scout.yaml")
