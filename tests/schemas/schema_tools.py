"""JSON Schemas of docs/schemas: reading them, walking a document along its schema, and wrong versions of a document."""

import copy
import json
import pathlib
import re

from jsonschema import Draft7Validator

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "docs/schemas"
UNKNOWN = "zqx_unknown"
HEAD = ("$schema", "title", "description")


def names():
    return sorted(file.name.removesuffix(".schema.json") for file in FOLDER.glob("*.schema.json"))


def load(name):
    """The schema with the parts of other files that it refers to among its definitions."""
    text = (FOLDER / f"{name}.schema.json").read_text()
    schema = json.loads(re.sub(r'"(\w+)\.schema\.json(?:#/definitions/(\w+))?"', lambda ref: f'"#/definitions/{ref[2] or ref[1]}"', text))
    for other in set(re.findall(r'"\$ref": "(\w+)\.schema\.json', text)):
        whole = load(other)
        schema["definitions"].update({**whole.pop("definitions", {}), other: {k: v for k, v in whole.items() if k not in HEAD}})
    return schema


def validator(name):
    return Draft7Validator(load(name))


def complaints(check, document):
    return [f"/{'/'.join(map(str, error.absolute_path))}: {error.message[:300]}" for error in check.iter_errors(document)]


class Walk:
    """The schema of each value in a document, which must be valid."""

    def __init__(self, schema):
        self.schema = schema

    def fits(self, node, value):
        return Draft7Validator({**node, "definitions": self.schema.get("definitions", {})}).is_valid(value)

    def node(self, node, value):
        """What says of `value` which members it has: references followed, the branch taken that it fits."""
        while True:
            if "$ref" in node:
                node = self.schema["definitions"][node["$ref"].rsplit("/", 1)[1]]
            elif len(node.get("allOf", [])) == 1 and "$ref" in node["allOf"][0]:
                node = node["allOf"][0]
            elif "oneOf" in node and "properties" not in node:
                node = next(branch for branch in node["oneOf"] if self.fits(branch, value))
            else:
                return node

    def places(self, value, node=None, at=()):
        """(place, schema there, value there), the whole first. Values whose schema allows anything are left out."""
        node = self.node(self.schema if node is None else node, value)
        if is_free(node):
            return
        yield at, node, value
        if isinstance(value, dict):
            for key, member in value.items():
                below = node.get("properties", {}).get(key, node.get("additionalProperties"))
                if isinstance(below, dict):
                    yield from self.places(member, below, (*at, key))
        elif isinstance(value, list):
            for index, member in enumerate(value):
                yield from self.places(member, node["items"], (*at, index))


def is_free(node):
    """It, or every member of it, may be anything."""
    kinds = node.get("type", [])
    kinds = {kinds} if isinstance(kinds, str) else set(kinds)
    if "object" in kinds and "properties" not in node and not isinstance(node.get("additionalProperties"), dict):
        return True
    return not kinds and not {"enum", "const", "oneOf", "allOf", "$ref", "if", "not"} & node.keys()


def free_places(schema, at=""):
    """Where a schema takes anything: places that somebody must have meant."""
    found = set()
    if schema.get("additionalProperties") is True:
        found.add(f"{at}/*")
    for key in ("properties", "definitions"):
        for name, node in schema.get(key, {}).items():
            found |= {f"{at}/{name}"} if is_free(node) else free_places(node, f"{at}/{name}")
    for key in ("items", "additionalProperties"):
        if isinstance(schema.get(key), dict):
            found |= {f"{at}/{key}"} if is_free(schema[key]) else free_places(schema[key], at)
    for branch in schema.get("oneOf", []):
        found |= free_places(branch, at)
    if schema.get("type") == "object" and "properties" in schema and "additionalProperties" not in schema and at.count("/") < 1:
        found.add(f"{at} (open)")
    return found


def changed(document, place, change):
    document = copy.deepcopy(document)
    at = document
    for key in place[:-1]:
        at = at[key]
    if place:
        at[place[-1]] = change(at[place[-1]])
        return document
    return change(document)


def wrong_versions(schema, document, most=400):
    """(what is wrong, document): an unknown member, another type, a member that is missing, at every place."""
    places = list(Walk(schema).places(document))
    stride = max(1, len(places) // most)
    for place, node, value in places[::stride] if len(places) > most else places:
        where = "/" + "/".join(map(str, place))
        other = {UNKNOWN: 1} if isinstance(value, list) else [UNKNOWN]
        yield f"{where} is {other}", changed(document, place, lambda _: other)
        if not isinstance(value, dict):
            continue
        if node.get("additionalProperties") is not True:
            yield f"{where} has an unknown member", changed(document, place, lambda one: {**one, UNKNOWN: [UNKNOWN]})
        for key in node.get("required", []):
            yield f"{where} lacks {key}", changed(document, place, lambda one: {k: v for k, v in one.items() if k != key})


def with_unknown_keys(schema, document):
    """The document with an unknown member in every object that names its members, and those members by place."""
    members, result = {}, copy.deepcopy(document)
    for place, node, value in Walk(schema).places(document):
        if not isinstance(value, dict) or "properties" not in node:
            continue
        members["/" + "/".join(map(str, (*place, UNKNOWN)))] = set(node["properties"]) - {"$schema"}
        result = changed(result, place, lambda one: {**one, UNKNOWN: 1})
    return result, members
