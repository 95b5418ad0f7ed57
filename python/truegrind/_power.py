"""Power study: how often a diagnosis finds the causes of a simulated arm."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Z = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


@dataclass(frozen=True)
class Study:
    """Data common to all runs: recipes by name with file and text, robot and options of the diagnosis."""

    recipes: tuple[tuple[str, str, str], ...]
    robot: str | None
    options: tuple[tuple[str, Any], ...]
    work: str | None

    def key(self, recipe: str, seed: int) -> str:
        """SHA-256 of everything that determines the result of a run."""
        from . import __version__

        text = next(text for name, _, text in self.recipes if name == recipe)
        parts = ["truegrind.power/1", __version__, text, seed, self.robot, sorted(self.options)]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def run(study: Study, recipe: str, seed: int) -> dict[str, Any]:
    """One run: simulates and diagnoses an arm, or returns the stored result."""
    import truegrind as tg

    place = Path(study.work) / f"{study.key(recipe, seed)}.json" if study.work else None
    if place is not None:
        try:
            return json.loads(place.read_text(encoding="utf-8"))
        except (FileNotFoundError, ValueError):
            pass
    path, text = next((path, text) for name, path, text in study.recipes if name == recipe)
    made = tg.simulate(path, seed=seed)
    out: dict[str, Any] = {"recipe": recipe, "seed": seed, "findings": [], "failed": None}
    try:
        found = tg.diagnose(made.dataset, study.robot or robot_of(path, text), threads=1, **dict(study.options))
    except tg.TruegrindError as error:
        out["failed"] = str(error)
    else:
        out["held_out_rmse_mm"] = found.held_out_rmse_mm
        out["geometry_rmse_mm"] = found.geometry_rmse_mm
        for finding in found.findings:
            kept = {name: finding.get(name) for name in ("effect", "joints", "confidence", "worth_mm")}
            out["findings"].append(kept)
    if place is not None:
        _put(place, json.dumps(out))
    return out


def robot_of(path: str, text: str) -> str:
    """The robot of a recipe: a name from the catalogue, or a file beside the recipe. Found by regex, since Python 3.10 has no TOML parser."""
    found = re.search(r"""^robot\s*=\s*["']([^"'\n]+)["']""", text, re.MULTILINE)
    name = found.group(1) if found else ""
    beside = Path(path).parent / name
    return str(beside) if name and beside.is_file() else name


def _put(place: Path, text: str) -> None:
    handle, name = tempfile.mkstemp(prefix=".part-", dir=place.parent)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    os.chmod(name, 0o666 & ~_umask())
    os.replace(name, place)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def interval(hits: int, runs: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a proportion (Wilson 1927, J. Am. Stat. Assoc. 22:209)."""
    if runs == 0:
        return (0.0, 1.0)
    share, square = hits / runs, Z * Z
    middle = (share + square / (2 * runs)) / (1 + square / runs)
    half = Z * math.sqrt(share * (1 - share) / runs + square / (4 * runs * runs)) / (1 + square / runs)
    return (max(0.0, middle - half), min(1.0, middle + half))


def table(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row per recipe and found cause: number of runs that named it and that identified it, with Wilson's 95 % interval of the share
    that named it. The cause ``None`` counts the runs without findings."""
    recipes: dict[str, list[dict[str, Any]]] = {}
    for one in runs:
        recipes.setdefault(one["recipe"], []).append(one)
    out = []
    for recipe, of in recipes.items():
        done = [one for one in of if one["failed"] is None]
        named: dict[tuple[str | None, tuple[int, ...]], list[bool]] = {} if done else {(None, ()): []}
        for one in done:
            seen: dict[tuple[str | None, tuple[int, ...]], bool] = {}
            for finding in one["findings"]:
                cause = (finding["effect"], tuple(finding["joints"] or ()))
                seen[cause] = seen.get(cause, False) or finding["confidence"] == "identified"
            for cause, identified in (seen or {(None, ()): False}).items():
                named.setdefault(cause, []).append(identified)
        for (effect, joints), sure in sorted(named.items(), key=lambda item: (-len(item[1]), str(item[0]))):
            low, high = interval(len(sure), len(done))
            out.append(
                {
                    "recipe": recipe,
                    "effect": effect,
                    "joints": list(joints),
                    "runs": len(done),
                    "failed": len(of) - len(done),
                    "named": len(sure),
                    "identified": sum(sure),
                    "share": len(sure) / len(done) if done else None,
                    "share_low": low,
                    "share_high": high,
                }
            )
    return out


def study(
    recipes: Any, robot: Any, work: Any, options: Mapping[str, Any]
) -> Study:
    """Makes a study from recipe files by name, or from one or more paths."""
    if isinstance(recipes, (str, os.PathLike)):
        recipes = [recipes]
    named = recipes.items() if isinstance(recipes, Mapping) else ((Path(path).name, path) for path in recipes)
    texts = tuple((name, os.fspath(path), Path(path).read_text(encoding="utf-8")) for name, path in named)
    folder = None
    if work is not None:
        folder = os.fspath(work)
        Path(folder).mkdir(parents=True, exist_ok=True)
    return Study(texts, None if robot is None else os.fspath(robot), tuple(options.items()), folder)
