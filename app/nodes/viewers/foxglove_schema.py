"""Schemas of JSON messages in the part of JSON Schema that Foxglove reads.

Foxglove takes one plain type for each field, and refuses a schema with references, alternatives or
arrays in arrays. Nullable fields get the type of their value; fields of other kinds are left out,
and shown all the same where a whole message is.
"""

from typing import Any

import msgspec
from msgspec import inspect

Schema = dict[str, Any]


def schema_of(kind: type[msgspec.Struct]) -> Schema:
    """Return the schema of a message."""
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType)
    return {"title": kind.__name__, **_object(info)}


def _object(info: inspect.StructType) -> Schema:
    fields = {field.encode_name: _field(field.type) for field in info.fields}
    shown = {name: schema for name, schema in fields.items() if schema is not None}
    return {"type": "object", "properties": shown}


def _field(info: inspect.Type) -> Schema | None:
    match info:
        case inspect.ListType() | inspect.VarTupleType():
            return _array(info.item_type)
        case inspect.TupleType():
            return _array(info.item_types[0])
        case inspect.UnionType():
            options = [one for one in info.types if not isinstance(one, inspect.NoneType)]
            return _field(options[0]) if len(options) == 1 else None
        case _:
            return _item(info)


def _array(info: inspect.Type) -> Schema | None:
    items = _item(info)
    return None if items is None else {"type": "array", "items": items}


def _item(info: inspect.Type) -> Schema | None:
    match info:
        case inspect.BoolType():
            return {"type": "boolean"}
        case inspect.IntType() | inspect.FloatType():
            return {"type": "number"}
        case inspect.StrType():
            return {"type": "string"}
        case inspect.LiteralType():
            return {"type": "string"} if isinstance(info.values[0], str) else {"type": "number"}
        case inspect.StructType() if not info.array_like:
            return _object(info)
        case _:
            return None
