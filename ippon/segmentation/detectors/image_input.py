"""Preparation of images for a network, and mapping of boxes back to the image."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Fit = Literal["corner", "centre", "stretch"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Placement:
    """Position of an image in a network's input."""

    image_size: tuple[int, int]
    """(H, W) of the image."""
    input_size: tuple[int, int]
    """(H, W) of the input."""
    scale: tuple[float, float]
    """Input pixels per image pixel: across, down."""
    offset: tuple[int, int]
    """Column and row of the input at which the image begins."""
    placed_size: tuple[int, int]
    """(H, W) of the image in the input."""

    def boxes_in_image(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map (N, 4) left, top, right, bottom from input pixels to image pixels."""
        return (boxes - np.tile(self.offset, 2)) / np.tile(self.scale, 2)

    def share_of_input(self, height: int, width: int) -> tuple[slice, slice]:
        """Return rows and columns of the image in an (h, w) array over the whole input."""
        column, row = self.offset
        down, across = height / self.input_size[0], width / self.input_size[1]
        top, left = round(row * down), round(column * across)
        bottom = max(top + 1, round((row + self.placed_size[0]) * down))
        right = max(left + 1, round((column + self.placed_size[1]) * across))
        return slice(top, bottom), slice(left, right)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageInput:
    """Preprocessing that a network expects.

    Values are (value - mean) * factor, in the order of `channels`.
    """

    size: tuple[int, int]
    """(H, W) in pixels."""
    fit: Fit
    """`corner` and `centre` keep the proportions and fill the rest with `padding`; `stretch` does
    not keep them."""
    channels: Literal["RGB", "BGR"] = "RGB"
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Subtracted from values of 0 to 255."""
    factor: tuple[float, float, float] = (1 / 255, 1 / 255, 1 / 255)
    padding: int | None = 114
    """Grey value around the image, 0 to 255; YOLO networks are trained with 114. None for the
    mean."""

    def place(self, image_size: tuple[int, int]) -> Placement:
        """Return the position of an (H, W) image in the input."""
        height, width = self.size
        if self.fit == "stretch":
            placed, offset = self.size, (0, 0)
        else:
            ratio = min(height / image_size[0], width / image_size[1])
            placed = (max(1, round(image_size[0] * ratio)), max(1, round(image_size[1] * ratio)))
            spare = (width - placed[1], height - placed[0])
            offset = (spare[0] // 2, spare[1] // 2) if self.fit == "centre" else (0, 0)
        return Placement(
            image_size=image_size,
            input_size=self.size,
            scale=(placed[1] / image_size[1], placed[0] / image_size[0]),
            offset=offset,
            placed_size=placed,
        )

    def prepare(self, color: NDArray[np.uint8]) -> tuple[NDArray[np.float32], Placement]:
        """Return the network's input, and the position of the image in it.

        Args:
            color: (H, W, 3) uint8 RGB.

        Returns:
            (3, h, w) float32, contiguous.
        """
        place = self.place((color.shape[0], color.shape[1]))
        (height, width), (column, row) = place.placed_size, place.offset
        resized = np.asarray(
            Image.fromarray(np.ascontiguousarray(color)).resize(
                (width, height), Image.Resampling.BILINEAR
            )
        )
        mean = np.array(self.mean, np.float32)[:, None, None]
        factor = np.array(self.factor, np.float32)[:, None, None]
        border = mean if self.padding is None else np.float32(self.padding)
        values = np.empty((3, *self.size), np.float32)
        values[:] = (border - mean) * factor
        if self.channels == "BGR":
            resized = resized[..., ::-1]
        planes = resized.transpose(2, 0, 1).astype(np.float32)
        values[:, row : row + height, column : column + width] = (planes - mean) * factor
        return values, place
