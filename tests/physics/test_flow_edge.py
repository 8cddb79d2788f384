"""Flow laws: what is told of an open edge is what flows."""

import pytest

from afo_sim.physics import FlowEdge, edge_flow, flow_edge

C, B = 1.2e-9, 0.35
EDGES = [
    FlowEdge("orifice", "a", "b", C, B),
    flow_edge.check_valve("check_valve", "a", "b", C, B, cracking=2e4),
    flow_edge.check_valve("throttle", "a", "b", C, B, cracking=0.0, throttle=0.4 * C, throttle_ratio=0.2),
    flow_edge.quick_exhaust("quick_exhaust", "a", "pilot", C, B, cracking=3e4),
    flow_edge.regulator("regulator", "a", "b", C, B, setting=2e5, per_droop=1e-9),
    flow_edge.relief("relief", "a", C, B, limit=2e5, per_excess=1e-9),
]


@pytest.mark.parametrize("edge", EDGES, ids=lambda edge: edge.name)
def test_what_is_told_of_an_open_edge_is_what_flows(edge: FlowEdge) -> None:
    """Choked flow each way is that of its sonic conductance, where nothing else holds it."""
    numbers = (*edge.parameters, 0.0, 0.0, 0.0, 0.0)[:4]
    high, low, t = 12e5, 1e5, 293.15
    for p1, p2, conductance in ((high, low, edge.forth), (low, high, edge.back)):
        state, own = (p1, t, p2, t), (edge.conductance, edge.critical_ratio)
        flow = edge_flow(edge.law, *state, 1.0, *own, (*numbers, low), 0, 4, 1)
        expected = conductance * flow_edge.STANDARD_DENSITY * high
        if edge.law in (flow_edge.REGULATED, flow_edge.RELIEF) and conductance > 0.0:
            assert 0.0 < abs(flow) <= expected * (1.0 + 1e-12)  # its set pressure may hold some of it
        else:
            assert abs(flow) == pytest.approx(expected if p1 > p2 or edge.back else 0.0)
