"""Croissant metadata of a dataset (https://docs.mlcommons.org/croissant/docs/croissant-spec.html), version 1.0."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pathlib
    from collections.abc import Mapping

FORMATS = {".csv": "text/csv", ".hdf5": "application/x-hdf5", ".json": "application/json"}
_TERMS = ("citeAs", "column", "data", "dataType", "equivalentProperty", "examples", "extract", "field", "fileProperty",
          "fileObject", "fileSet", "format", "includes", "isLiveDataset", "jsonPath", "key", "md5", "parentField", "path",
          "recordSet", "references", "regex", "repeated", "replace", "samplingRate", "separator", "source", "subField",
          "transform")
CONTEXT: dict[str, Any] = {
    "@language": "en", "@vocab": "https://schema.org/", "sc": "https://schema.org/", "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/", "dct": "http://purl.org/dc/terms/", "conformsTo": "dct:conformsTo",
    **{term: f"cr:{term}" for term in _TERMS}, "data": {"@id": "cr:data", "@type": "@json"},
    "examples": {"@id": "cr:examples", "@type": "@json"}, "dataType": {"@id": "cr:dataType", "@type": "@vocab"}}


def described(folder: pathlib.Path, names: list[str], table: str, columns: Mapping[str, str], **facts: str) -> dict[str, Any]:
    """The JSON-LD of a dataset.

    Args:
        folder: Folder of the dataset.
        names: Its files, relative to the folder.
        table: The one of them, a CSV file, whose rows are the records.
        columns: Their data type in schema.org's vocabulary, by column.
        facts: Properties of schema.org's Dataset, such as name and description.
    """
    files = [{"@type": "cr:FileObject", "@id": name, "name": name, "contentUrl": name,
              "encodingFormat": FORMATS[(folder / name).suffix], "sha256": file_hash(folder / name)} for name in names]
    record = table.partition(".")[0]
    fields = [{"@type": "cr:Field", "@id": f"{record}/{column}", "name": column, "dataType": f"sc:{kind}",
               "source": {"fileObject": {"@id": table}, "extract": {"column": column}}} for column, kind in columns.items()]
    return {"@context": CONTEXT, "@type": "sc:Dataset", "conformsTo": "http://mlcommons.org/croissant/1.0", **facts,
            "distribution": files, "recordSet": [{"@type": "cr:RecordSet", "@id": record, "name": record, "field": fields}]}


def file_hash(file: pathlib.Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
