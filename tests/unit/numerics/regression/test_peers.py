"""The comparison with other packages: numbers in one order, and a peer that is better is told."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete

FOLDER = Path(__file__).parents[4] / "benchmarks" / "peers"


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The folder's modules, only while a test runs: their names are plain words."""
    before = set(sys.modules)
    monkeypatch.syspath_prepend(str(FOLDER))
    yield
    for path in FOLDER.glob("*.py"):
        if path.stem not in before:
            sys.modules.pop(path.stem, None)


@pytest.mark.usefixtures("peers")
def test_every_peer_says_m_b_k_row_by_row(tmp_path: Path) -> None:
    make, record = (importlib.import_module(n) for n in ("make_records", "record"))
    truth = make.make_hand(tmp_path, 100)
    hand = record.load_hand(tmp_path)
    # a limb that is not symmetric: half of the second force, so half of the second rows
    scaled = np.array([1.0, 0.5])
    bent = type(hand)(hand.rate_hz, hand.lag_s, hand.position, hand.force * scaled, hand.each)
    asked = (truth.reshape(3, 2, 2) * scaled[:, None]).ravel()
    for module in ("with_armimpedance", "with_scipy", "with_statsmodels"):
        values, half = importlib.import_module(module).hand(bent)
        assert values.shape == half.shape == (4, 12)
        assert (half > 0).all()
        mean = values.mean(axis=0)
        assert np.linalg.norm((mean - asked)[:8]) < 0.1 * np.linalg.norm(asked[:8]), module


@pytest.mark.usefixtures("peers")
def test_a_discrete_model_goes_back_to_its_joint() -> None:
    discrete = importlib.import_module("discrete")
    inertia, viscosity, stiffness = 0.07, 0.6, 20.0
    b, a, _ = cont2discrete(([1.0], [inertia, viscosity, stiffness]), 1 / 50, "zoh")
    found = discrete.continuous(a[1:], b.ravel(), 50.0)
    np.testing.assert_allclose(found, [inertia, viscosity, stiffness], rtol=1e-9)


@pytest.mark.usefixtures("peers")
@pytest.mark.parametrize(("factor", "told"), [(0.3, True), (1.0, False), (3.0, False)])
def test_a_peer_that_is_clearly_better_is_told(factor: float, told: bool, tmp_path: Path) -> None:
    compare, table = (importlib.import_module(n) for n in ("compare", "table"))
    rng, truth = np.random.default_rng(1), np.arange(1.0, 13.0)
    rows = {p.name: {10: {"reason": "not here"}} for p in table.PEERS}
    own, peer = table.PEERS[0], next(p for p in table.PEERS if p.name == "SciPy loop")
    for who, size in ((own, 1.0), (peer, factor)):
        values = truth + size * rng.normal(0, 0.1, (200, 12))
        (tmp_path / "hand").mkdir(exist_ok=True)
        file = tmp_path / "hand" / f"{who.module}_{who.function}_10.npz"
        np.savez(file, values=values, half=np.full_like(values, size * 0.196))
        rows[who.name] = {10: {"processor_s": 1.0, "peak_mb": 1.0}}
    rigs = {"hand": {"truth": truth.tolist(), "sizes": [10], "rows": rows}}
    results = compare.summary({"rigs": rigs}, tmp_path)
    accuracy = results["rigs"]["hand"]["accuracy"]["SciPy loop"]
    assert accuracy["coverage"] == pytest.approx([95, 95, 95], abs=3)
    assert any("SciPy loop" in line for line in compare.verdicts(results)) == told
    assert "SciPy loop" in compare.markdown(results)
