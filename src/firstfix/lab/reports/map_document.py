"""What is known of a map, and of sensors in it, as JSON values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from firstfix.core.grid import OccupancyGrid
from firstfix.io.maps.check import MapCheck
from firstfix.lab.experiments import perceptual_aliasing, sensor_prediction
from firstfix.lab.experiments.perceptual_aliasing import Look, Place, doubles
from firstfix.lab.experiments.sensor_prediction import Answer, Effort, Prediction

_SHARE_DIGITS = 4


def check_document(found: MapCheck) -> dict[str, Any]:
    """Return sizes, shares and warnings of a map."""
    return {
        "yaml": f"{found.yaml}",
        "image": f"{found.image}",
        "pixels": found.pixels,
        "mode": found.mode.value,
        "cells": [found.width, found.height],
        "size_m": [found.width_m, found.height_m],
        "resolution": found.resolution,
        "origin": found.T_map_grid.as_array().tolist(),
        "free": round(found.free, _SHARE_DIGITS),
        "occupied": round(found.occupied, _SHARE_DIGITS),
        "unknown": round(found.unknown, _SHARE_DIGITS),
        "free_area_m2": found.free_area,
        "warnings": list(found.warnings),
    }


def size_document(grid: OccupancyGrid) -> dict[str, Any]:
    """Return the size of a map."""
    return {
        "cells": [grid.width, grid.height],
        "size_m": [grid.width * grid.resolution, grid.height * grid.resolution],
        "resolution": grid.resolution,
        "origin": grid.T_map_grid.as_array().tolist(),
        "free_area_m2": grid.free_area,
    }


def aliasing_document(places: Sequence[Place]) -> dict[str, Any]:
    """Return the shares of places by what fits a scan there, and the pairs that look alike."""
    shares = {look: round(perceptual_aliasing.share(places, look), _SHARE_DIGITS) for look in Look}
    return {
        "samples": len(places),
        "one_place_right": shares[Look.FOUND],
        "several_places": shares[Look.AMBIGUOUS],
        "no_place": shares[Look.LOST],
        "one_place_wrong": shares[Look.MISTAKEN],
        "needs_second_view": any(place.needs_second_view for place in places),
        "pairs": [
            {
                "pose": pose.as_array().tolist(),
                "other": double.pose.as_array().tolist(),
                "probability": double.probability,
            }
            for pose, double in doubles(places)
        ],
    }


def prediction_document(words: str, predictions: Sequence[Prediction]) -> dict[str, Any]:
    """Return how often one scan, one turn and one metre are enough for a sensor."""
    little = sum(prediction.sees_little for prediction in predictions)
    return {
        "sensor": words,
        "samples": len(predictions),
        **{
            answer.value: {
                effort.name.lower(): round(
                    sensor_prediction.share(predictions, effort, answer), _SHARE_DIGITS
                )
                for effort in Effort
            }
            for answer in Answer
        },
        "sees_too_little": round(little / max(1, len(predictions)), _SHARE_DIGITS),
    }
