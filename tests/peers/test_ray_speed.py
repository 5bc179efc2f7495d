"""The rays of the comparison of speeds, and its table with few rays and short times."""

import conftest
import numpy as np
import program
import pytest
import ray_speed

FEW = 12
# As in test_rays.py; float has 24 bits of 20 mm, and eight faces add up.
ALLOWED_MM = {"double": 1e-12, "float": 2e-5}


@pytest.fixture(scope="module")
def block():
    lens, scene = program.lens(), ray_speed.scene()
    starts, directions = ray_speed.rays_of_block(lens, scene)
    return lens, scene, starts, directions


def test_rays_arrive_where_those_of_the_benchmark_start(block, figures):
    _, scene, starts, directions = block
    missed = ray_speed.missed_sensor_point_mm(ray_speed.our_hits(starts, directions), ray_speed.sensor_point(scene)[0])
    figures.append(f"rays of trace_block: {len(starts)} reach their point of the sensor within {missed:.1e} mm")
    assert missed < 1e-12


@pytest.mark.parametrize("peer", ray_speed.PEERS, ids=lambda peer: f"{peer.program}, {peer.precision}")
def test_intersections_agree(peer, block, figures):
    conftest.need(peer.package, *(["torch"] if peer.backend == "torch" else []))
    lens, _, starts, directions = block
    which = np.linspace(0, len(starts) - 1, FEW).astype(int)
    found = ray_speed.hits_of(peer, lens, starts[which], directions[which])
    difference = np.linalg.norm(found - ray_speed.our_hits(starts[which], directions[which]), axis=2).max()
    figures.append(f"{peer.program}, {peer.precision}: {FEW} rays of trace_block: {difference:.1e} mm")
    assert difference < ALLOWED_MM[peer.precision]


def test_table_has_all_programs_and_names_missing_ones(monkeypatch):
    if not ray_speed.perf_path().is_file():
        pytest.skip("relign-bench-perf is not built (./quickstart peers builds it)")
    monkeypatch.setattr(ray_speed, "CALLS", (256,))
    result = ray_speed.compare(rounds=1, at_least=0.01)
    timed = {(each["program"], each["precision"]) for each in result["programs"]}
    for peer in ray_speed.PEERS:
        named = any(line.startswith(f"{peer.program}, {peer.precision}:") for line in result["missing"])
        assert ((peer.program, peer.precision) in timed) != named
    assert len(ray_speed.table(result).splitlines()) == 2 + len(result["programs"])
    for each in result["programs"]:
        assert each["seconds"] > 0
        assert each["million_ray_surfaces_per_second"] * each["seconds"] * 1e6 == pytest.approx(each["rays"] * each["surfaces"])
