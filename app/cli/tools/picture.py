"""Reading of a picture that the user names."""

import warnings
from pathlib import Path
from typing import Final

import numpy as np
import simplejpeg
from PIL import Image, ImageOps, UnidentifiedImageError

from app.errors import UsageError

MAX_SIDE_PX: Final = 768
"""A larger picture is reduced: models see no more than that of an object."""
_QUALITY: Final = 85


def read_jpeg(path: Path) -> bytes:
    """Return a picture of any common format as JPEG, upright and of at most `MAX_SIDE_PX` a side.

    Raises:
        UsageError: The file cannot be read, or is no picture.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as opened:
                opened.draft("RGB", (MAX_SIDE_PX, MAX_SIDE_PX))
                image = ImageOps.exif_transpose(opened).convert("RGB")
    except UnidentifiedImageError:
        raise UsageError(
            f"{path} is no picture in a known format: give a JPEG, PNG or WebP file"
        ) from None
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise UsageError(f"{path} has too many pixels: reduce it to 4000 a side or less") from None
    except (OSError, ValueError, SyntaxError) as error:
        raise UsageError(f"cannot read the picture {path}: {error}") from error
    image.thumbnail((MAX_SIDE_PX, MAX_SIDE_PX))
    return simplejpeg.encode_jpeg(np.asarray(image), _QUALITY, "RGB", "420")
