"""Classes of a detector's outputs, from files."""

import ast
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, cast

import yaml

from ippon.segmentation.detectors.coco import COCO_80, COCO_91, NO_CLASS, synonyms_of_class
from ippon.segmentation.detectors.errors import OutputError
from ippon.segmentation.detectors.families import OutputLayout
from ippon.segmentation.detectors.model_file import HUB_FOLDER
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.segmentation.errors import CheckpointError
from ippon.vocabulary import canonical_label

MOST_CLASSES: Final = 10_000
_LARGEST_FILE: Final = 1_000_000
"""Bytes; ten thousand names take a fifth of it."""
_NUMBER: Final = re.compile(r"(LABEL_)?\d+")
_NONE: Final = frozenset({"", "-", "n/a", "background", "no_object"})
"""Names of outputs without a class."""


def read_labels_file(path: Path) -> ClosedVocabulary:
    """Read a list of classes: one name per line, in the order of the network's outputs.

    `couch = sofa, settee` lists the labels of a class; a plain name stands for itself and its
    common synonyms. A line `-` stands for an output without a class.

    Raises:
        CheckpointError: The file is missing, or is not a list of names.
    """
    if not path.is_file():
        raise CheckpointError(f"there is no labels file {path}")
    if path.stat().st_size > _LARGEST_FILE:
        raise CheckpointError(
            f"{path} is not a list of labels: it is larger than {_LARGEST_FILE} B"
        )
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise CheckpointError(f"{path} is not a list of labels: it is not text") from error
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise CheckpointError(f"{path} holds no labels: it takes one name a line")
    classes: list[str] = []
    told: list[tuple[str, ...]] = []
    for number, line in enumerate(lines, start=1):
        name, equals, said = line.partition("=")
        if not name.strip():
            raise CheckpointError(
                f"line {number} of {path} holds no name; '-' stands for an output without a class"
            )
        classes.append(_class(name))
        labels = [canonical_label(part) for part in said.split(",") if part.strip()]
        if equals and not labels:
            raise CheckpointError(f"line {number} of {path} says no label after '='")
        told.append(tuple(dict.fromkeys(labels)))
    own = {*classes, *(label for labels in told for label in labels)}
    answers = (
        labels or (synonyms_of_class(name, own) if name else ())
        for name, labels in zip(classes, told, strict=True)
    )
    return ClosedVocabulary(tuple(classes), tuple(answers))


def labels_beside(model: Path, notes: Mapping[str, str]) -> ClosedVocabulary | None:
    """Return the classes in a model's metadata or in a file beside it; else None.

    Args:
        model: The file. `config.json` of `transformers` and `metadata.yaml` of Ultralytics may lie
            beside it.
        notes: Metadata of the model; `names` is a table of classes in Ultralytics exports.

    Raises:
        CheckpointError: The entry is not a table of classes.
    """
    if "names" in notes:
        try:
            # Literals only, because the text is untrusted.
            return _numbered(ast.literal_eval(notes["names"]))
        except (ValueError, SyntaxError, MemoryError, RecursionError) as error:
            raise CheckpointError(
                f"{model.name} has class names that are not a table: {notes['names'][:60]!r}"
            ) from error
    said = read_description(model).get("id2label")
    if said is None and model.suffix == ".param":
        said = read_description(model, "metadata.yaml").get("names")
    return None if said is None else _numbered(said)


def read_description(model: Path, name: str = "config.json") -> Mapping[str, Any]:
    """Return the content of a file beside a model or above its `HUB_FOLDER`; empty without one.

    Raises:
        CheckpointError: The file is not a JSON or YAML object.
    """
    beside = [model.parent / name]
    if model.absolute().parent.name == HUB_FOLDER:
        beside.append(model.absolute().parent.parent / name)
    path = next((path for path in beside if path.is_file()), None)
    if path is None:
        return {}
    try:
        text = path.read_text(encoding="utf-8")
        said = yaml.safe_load(text) if path.suffix == ".yaml" else json.loads(text)
    except (ValueError, RecursionError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())[:200]
        raise CheckpointError(f"{path} cannot be read: {reason}") from error
    if not isinstance(said, dict):
        raise CheckpointError(f"{path} is not a description of a model: it contains no object")
    return cast("Mapping[str, Any]", said)


def _numbered(said: object) -> ClosedVocabulary | None:
    """Return the vocabulary of a list of names, or of a table from numbers to names.

    Returns:
        None if the names are only numbers, as exporters write without names.
    """
    if isinstance(said, Sequence) and not isinstance(said, str):
        said = dict(enumerate(said))
    if not isinstance(said, Mapping) or not said:
        raise CheckpointError(f"names of classes are a table; got {str(said)[:60]!r}")
    try:
        names = {int(number): str(name) for number, name in said.items()}
    except (TypeError, ValueError) as error:
        raise CheckpointError(f"classes have numbers; got {str(said)[:60]!r}") from error
    if min(names) < 0 or max(names) >= MOST_CLASSES:
        raise CheckpointError(f"classes are numbered from 0 to {MOST_CLASSES}; got {max(names)}")
    if all(_NUMBER.fullmatch(name) for name in names.values()):
        return None
    return ClosedVocabulary.of([_class(names.get(n, "")) for n in range(max(names) + 1)])


def _class(name: str) -> str:
    label = canonical_label(name)
    return NO_CLASS if label.strip("_") in _NONE else label


def matched_vocabulary(
    vocabulary: ClosedVocabulary | None, layout: OutputLayout
) -> ClosedVocabulary:
    """Return the vocabulary for a network's outputs; COCO's by default.

    Raises:
        OutputError: The number of classes differs from that of the outputs.
    """
    wanted = layout.classes
    if vocabulary is None:
        usual = {80: COCO_80, 91: COCO_91}.get(80 if wanted is None else wanted)
        if usual is None:
            raise OutputError(
                f"this network tells {wanted} classes and does not say which: name them in a file, "
                "one a line, with --segmentation.labels-file"
            )
        return ClosedVocabulary.of(usual)
    count = len(vocabulary.classes)
    if wanted is None or count == wanted:
        return vocabulary
    if layout.spare_column and count + 1 == wanted:
        return ClosedVocabulary((*vocabulary.classes, NO_CLASS), (*vocabulary.answers, ()))
    raise OutputError(
        f"this network tells {wanted} classes and the labels name {count}; the labels file needs "
        f"{wanted} lines, in the order of the network's outputs ('-' for an output without a class)"
    )
