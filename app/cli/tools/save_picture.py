"""Writing of pictures."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.errors import UsageError

if TYPE_CHECKING:
    from PIL import Image


def save_picture(image: "Image.Image", path: Path) -> None:
    """Write a picture in the format of the file's name.

    Raises:
        UsageError: The file cannot be written.
    """
    try:
        image.save(path)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"cannot write the picture to {path}: {error}; name a file that ends in .png, in a "
            "folder that exists"
        ) from error
