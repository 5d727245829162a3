"""What tests of the report pages share: a page taken apart as a browser would."""

from __future__ import annotations

import json
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np
import pytest


class Parsed(HTMLParser):
    """Elements, texts and the contents of scripts of one page."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.scripts, self.texts = [], [], []
        self._inside = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._inside = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag):  # noqa: ARG002
        self._inside = ""

    def handle_data(self, data):
        if self._inside == "script":
            self.scripts[-1] += data
        elif self._inside != "style":
            self.texts.append(data)

    @property
    def words(self):
        return " ".join(" ".join(self.texts).split())

    def data(self, name):
        """One of the page's tables, decoded as its script does."""
        return {key: decoded(column) for key, column in self._json("data")[name].items()}

    def specs(self):
        return self._json("specs")

    def _json(self, name):
        numbers = [a.get("id") for tag, a in self.elements if tag == "script"]
        return json.loads(self.scripts[numbers.index(name)])


def decoded(column):
    if isinstance(column, list):
        return column
    if "texts" in column:
        return [column["texts"][i] for i in column["of"]]
    return np.frombuffer(b64decode(column["int16"]), "<i2") * column["step"]


@pytest.fixture(scope="session")
def parse():
    return Parsed
