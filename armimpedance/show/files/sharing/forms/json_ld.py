"""Metadata of a dataset for repositories and search engines: JSON-LD in the words of schema.org."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armimpedance.core.json_text import json_text
from armimpedance.show.files.sharing.bids_text import dataset_name
from armimpedance.show.files.sharing.columns import data_files, missing_words, variables
from armimpedance.show.files.sharing.form import Form, Shared

_MEDIA = {
    ".csv": "text/csv",
    ".tsv": "text/tab-separated-values",
    ".json": "application/json",
    ".parquet": "application/vnd.apache.parquet",
    ".md": "text/markdown",
    ".zip": "application/zip",
    ".gz": "application/gzip",
}


def _write(shared: Shared, file: Path) -> tuple[str, ...]:
    statement = shared.statement
    document: dict[str, Any] = {
        "description": statement.description,
        "creator": [{"@type": "Person", "name": name} for name in statement.creators],
        "license": _licence(statement.licence),
        "identifier": statement.identifier,
        "url": statement.url,
        "keywords": list(statement.keywords),
        "funding": [{"@type": "Grant", "name": name} for name in statement.funding],
    }
    content = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": dataset_name(shared),
        **{key: value for key, value in document.items() if value},
        "variableMeasured": [
            {
                "@type": "PropertyValue",
                "name": v.name,
                **({"description": v.words} if v.words else {}),
                **({} if v.unit == "n/a" else {"unitText": v.unit}),
            }
            for v in variables(shared)
        ],
        "distribution": [
            {
                "@type": "DataDownload",
                "name": each.name,
                "contentSize": f"{each.size} B",
                "sha256": each.sha256,
                **({"encodingFormat": _MEDIA[each.ending]} if each.ending in _MEDIA else {}),
            }
            for each in data_files(shared)
        ],
    }
    file.write_text(json_text(content), encoding="utf-8")
    return missing_words(shared)


def _licence(text: str | None) -> str | None:
    """The licence as an address; the short names of SPDX have one."""
    if text is None or "://" in text or " " in text:
        return text
    return f"https://spdx.org/licenses/{text}"


FORM = Form(
    what="metadata for a data repository (schema.org/Dataset)",
    write=_write,
    endings=(".jsonld", ".json"),
)
