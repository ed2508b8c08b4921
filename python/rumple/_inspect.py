"""Evaluated states: JSON of the engine with its lists as arrays."""

import json

import numpy


def state(text):
    """The state in the JSON `text`."""
    return _arrays(json.loads(text))


def _arrays(value):
    if isinstance(value, dict):
        return {name: _arrays(item) for name, item in value.items()}
    return numpy.array(value) if isinstance(value, list) else value
