"""The image processors of `transformers`, as the reference for what is done to results.

Their modules import torchvision, which the product does without. Where it is absent, a stand-in of
the names that they import lets them load; the functions used here do not call it.
"""

import importlib
import importlib.util
import sys
from types import ModuleType

import pytest

WITH_TORCHVISION = pytest.mark.skipif(
    importlib.util.find_spec("torchvision") is None,
    reason="the library prepares images with torchvision, which is not installed",
)


def image_processor(name: str) -> type:
    """Return the class of an image processor, such as `Sam3ImageProcessor` of `sam3`."""
    module, _, kind = name.rpartition(".")
    path = f"transformers.models.{module}.image_processing_{module}"
    if importlib.util.find_spec("torchvision") is not None or path in sys.modules:
        return getattr(importlib.import_module(path), kind)
    names = ("torchvision", "torchvision.ops", "torchvision.ops.boxes")
    try:
        sys.modules.update({one: ModuleType(one) for one in names})
        sys.modules["torchvision.ops.boxes"].batched_nms = None
        return getattr(importlib.import_module(path), kind)
    finally:
        for one in names:
            del sys.modules[one]
