"""What the product has of compiled kernels, and which of them are ready."""

import ast
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from types import ModuleType

from numba import types
from numba.core.dispatcher import Dispatcher

import ippon

_OF_NETWORKS = ("ippon.segmentation.backends", "ippon.segmentation.detectors")
_NOT_OF_THE_NAVIGATOR = (
    *_OF_NETWORKS,
    "ippon.calibration",
    "ippon.evaluation",
    "ippon.simulation",
)


def ready() -> set[str]:
    """Return every kernel of the navigator with each kind of arguments that it is compiled for."""
    return {
        f"{name_of(kernel)}{signature}"
        for module in _modules()
        for kernel in vars(module).values()
        if isinstance(kernel, Dispatcher)
        for signature in kernel.overloads
    }


def missing() -> set[str]:
    """Return the kernels that Python code of the navigator calls and that are not ready."""
    return {name_of(kernel) for kernel in _called_from_python() if not kernel.overloads}


def returning_borrowed() -> set[str]:
    """Return the kernels that return an array which they only borrow (see `compiling.njit`)."""
    return {
        f"{name_of(kernel)} returns a borrowed array"
        for module in _modules(left_out=_OF_NETWORKS)
        for kernel in vars(module).values()
        if isinstance(kernel, Dispatcher) and not kernel.targetoptions.get("_nrt", True)
        for signature in kernel.nopython_signatures
        if _holds_array(signature.return_type)
    }


def _holds_array(kind: types.Type) -> bool:
    if isinstance(kind, types.BaseTuple):
        return any(_holds_array(k) for k in kind)
    if isinstance(kind, types.Optional):
        return _holds_array(kind.type)
    return isinstance(kind, types.Array)


def name_of(kernel: Dispatcher) -> str:
    """Return where it is and how it is called."""
    return f"{kernel.py_func.__module__}.{kernel.py_func.__name__}"


def _called_from_python() -> set[Dispatcher]:
    """Find them by name in every function that is no kernel itself."""
    found: set[Dispatcher] = set()
    for module in _modules():
        tree = ast.parse(inspect.getsource(module))
        kernels = {n for n, value in vars(module).items() if isinstance(value, Dispatcher)}
        inside = [n for n in tree.body if getattr(n, "name", None) in kernels]
        compiled = {id(n) for kernel in inside for n in ast.walk(kernel)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and node.id in kernels and id(node) not in compiled:
                found.add(getattr(module, node.id))
    return found


def _modules(left_out: tuple[str, ...] = _NOT_OF_THE_NAVIGATOR) -> Iterator[ModuleType]:
    for info in pkgutil.walk_packages(ippon.__path__, "ippon."):
        if not info.name.startswith(left_out):
            yield importlib.import_module(info.name)
