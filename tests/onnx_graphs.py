"""Small ONNX files for tests, made of operators or of given outputs."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

OPSET = [helper.make_opsetid("", 17)]
IMAGE = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, 64, 64])


def save(path: Path, nodes, inputs, outputs, initializers=(), notes=None, opsets=OPSET) -> Path:
    """Write a graph to a file."""
    graph = helper.make_graph(nodes, "graph", inputs, outputs, list(initializers))
    model = helper.make_model(graph, opset_imports=opsets, ir_version=8)
    if notes:
        helper.set_model_props(model, dict(notes))
    onnx.save(model, path)
    return path


def image_input(name="images", shape=(1, 3, 64, 64), kind=TensorProto.FLOAT):
    return helper.make_tensor_value_info(name, kind, list(shape))


def constant_network(
    path: Path, outputs: Mapping[str, np.ndarray], *, inputs=None, notes=None
) -> Path:
    """Write a network that gives the same outputs for every image."""
    held = [numpy_helper.from_array(values, f"held_{name}") for name, values in outputs.items()]
    nodes = [helper.make_node("Identity", [f"held_{name}"], [name]) for name in outputs]
    infos = [
        helper.make_tensor_value_info(
            name, helper.np_dtype_to_tensor_dtype(values.dtype), list(values.shape)
        )
        for name, values in outputs.items()
    ]
    return save(path, nodes, inputs or [image_input()], infos, held, notes)


def bright_box_network(path: Path, side: int, threshold: float) -> Path:
    """Write a network that gives the box around what is bright in the first channel.

    One row: left, top, right, bottom, score 0.9, class 41 (COCO's cup).
    """
    nodes = [
        helper.make_node("Slice", ["images", "zero", "one", "axis"], ["first"]),
        helper.make_node("Greater", ["first", "threshold"], ["above"]),
        helper.make_node("Cast", ["above"], ["bright"], to=TensorProto.FLOAT),
    ]
    for name, axis in (("across", 2), ("down", 3)):
        nodes += [
            helper.make_node("ReduceMax", ["bright"], [f"{name}_any"], axes=[1, axis], keepdims=0),
            helper.make_node("Mul", [f"{name}_any", "ends"], [f"{name}_ends"]),
            helper.make_node("ReduceMax", [f"{name}_ends"], [f"{name}_high"], axes=[1]),
            helper.make_node("Mul", [f"{name}_any", "rests"], [f"{name}_rests"]),
            helper.make_node("ReduceMax", [f"{name}_rests"], [f"{name}_rest"], axes=[1]),
            helper.make_node("Sub", ["side", f"{name}_rest"], [f"{name}_low"]),
        ]
    parts = ["across_low", "down_low", "across_high", "down_high", "score", "number"]
    nodes += [
        helper.make_node("Concat", parts, ["row"], axis=1),
        helper.make_node("Unsqueeze", ["row", "axis"], ["output0"]),
    ]
    index = np.arange(side, dtype=np.float32)
    values = {
        "zero": np.array([0], np.int64),
        "one": np.array([1], np.int64),
        "axis": np.array([1], np.int64),
        "threshold": np.array(threshold, np.float32),
        "ends": index + 1,
        "rests": side - index,
        "side": np.array(side, np.float32),
        "score": np.array([[0.9]], np.float32),
        "number": np.array([[41.0]], np.float32),
    }
    held = [numpy_helper.from_array(array, name) for name, array in values.items()]
    output = helper.make_tensor_value_info("output0", TensorProto.FLOAT, [1, 1, 6])
    return save(path, nodes, [image_input(shape=(1, 3, side, side))], [output], held)
