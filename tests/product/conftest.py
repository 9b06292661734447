"""Processes of the product, as the tests of `app` start them."""

from tests.app.conftest import launch, runtime

__all__ = ["launch", "runtime"]
