"""Mutants of a module: its syntax tree with one place changed.

Changed are comparisons, arithmetic, `and` and `or`, conditions, numbers, booleans, pairs of
functions such as min and max, and statements that only have an effect. Annotations, decorators,
strings and assertions stay as they are.
"""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass
from types import CodeType

_COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}
_PAIRS = (("min", "max"), ("any", "all"), ("floor", "ceil"), ("minimum", "maximum"), ("sin", "cos"))
_FUNCTIONS = {a: b for one, other in _PAIRS for a, b in ((one, other), (other, one))}
_KEPT = frozenset({"annotation", "returns", "decorator_list", "format_spec", "type_params"})


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of a module."""

    line: int
    before: str
    after: str
    code: CodeType


def mutants(source: str, path: str) -> Iterator[Mutant]:
    """Yield every mutant of a module.

    Args:
        source: Its text.
        path: Its file, for tracebacks.
    """
    tree = ast.parse(source)
    for parent, field, index, node in list(_places(tree)):
        for new in _variants(node):
            ast.copy_location(new, node)
            _put(parent, field, index, new)
            code = compile(ast.fix_missing_locations(tree), path, "exec")
            _put(parent, field, index, node)
            yield Mutant(node.lineno, _first_line(node), _first_line(new), code)


def _places(node: ast.AST) -> Iterator[tuple[ast.AST, str, int | None, ast.AST]]:
    """Yield the nodes below one that may be changed, with where they are."""
    for field, value in ast.iter_fields(node):
        if field in _KEPT:
            continue
        for index, child in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if isinstance(child, ast.AST) and not isinstance(child, ast.Assert):
                yield node, field, index, child
                yield from _places(child)


def _first_line(node: ast.AST) -> str:
    return ast.unparse(node).split("\n")[0]


def _put(parent: ast.AST, field: str, index: int | None, node: ast.AST) -> None:
    if index is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[index] = node


def _variants(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Compare(ops=ops):
            for k, op in enumerate(ops):
                for other in _COMPARISONS[type(op)]:
                    yield _with(node, ops=[*ops[:k], other(), *ops[k + 1 :]])
        case ast.BinOp(op=op) if type(op) in _OPERATORS:
            yield _with(node, op=_OPERATORS[type(op)]())
        case ast.AugAssign(op=op):
            yield ast.Pass()
            if type(op) in _OPERATORS:
                yield _with(node, op=_OPERATORS[type(op)]())
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield operand
        case ast.BoolOp(op=op):
            yield _with(node, op=ast.Or() if isinstance(op, ast.And) else ast.And())
        case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
            if isinstance(test, ast.Name | ast.Attribute | ast.Call):
                yield _with(node, test=ast.UnaryOp(ast.Not(), test))
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1)
            yield ast.Constant(value - 1)
        case ast.Constant(value=float(value)):
            yield from map(ast.Constant, (2.0 * value, 0.5 * value) if value else (1.0, -1.0))
        case ast.Call(func=ast.Name(id=name) as func) if name in _FUNCTIONS:
            yield _with(node, func=_with(func, id=_FUNCTIONS[name]))
        case ast.Call(func=ast.Attribute(attr=name) as func) if name in _FUNCTIONS:
            yield _with(node, func=_with(func, attr=_FUNCTIONS[name]))
        case ast.Expr(value=ast.Call()) | ast.Raise():
            yield ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
            yield ast.Pass()
        case ast.Continue():
            yield ast.Break()
        case ast.Break():
            yield ast.Continue()
        case _:
            return


def _with(node: ast.AST, **changed: object) -> ast.AST:
    new = copy.copy(node)
    for field, value in changed.items():
        setattr(new, field, value)
    return new
