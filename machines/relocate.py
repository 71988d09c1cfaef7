"""Where a machine must be when all that is known is that a node is active, and where it was before."""

from __future__ import annotations

from teleop_sim.machines.elements import Concurrence
from teleop_sim.machines.net import TOP, Configuration, Net


def put(net: Net, before: Configuration, node: int) -> Configuration:
    """The configuration with the node active that keeps as much of another as can be: a guess.

    What runs beside the node in a concurrence stays; what must have been entered with it stands at its start.
    """
    if net.on_path(before, node):
        return before
    holder = next((c for c in net.containers(node) if net.on_path(before, c)), TOP)
    branch = _toward(net, holder, node)
    beside = isinstance(net.nodes[holder].element, Concurrence) and holder not in before.active
    # A group has one child at a time, and a container that has ended inside begins anew.
    out = branch if beside else holder
    active = tuple(n for n in before.active if not net.inside(n, out))
    parked = tuple(e for e in before.parked if not net.inside(net.source[e], out))
    entered = _entered(net, branch if beside else holder, node)
    return Configuration(tuple(sorted((*active, *entered))), parked)


def _entered(net: Net, container: int, node: int) -> tuple[int, ...]:
    """What is active in a container when the node in it is."""
    if container == node:
        return net.nodes[node].entry
    branch = _toward(net, container, node)
    if not isinstance(net.nodes[container].element, Concurrence):
        return _entered(net, branch, node)
    others = (n.number for n in net.nodes if n.parent == container and n.number != branch)
    return (*_entered(net, branch, node), *(e for other in others for e in net.nodes[other].entry))


def _toward(net: Net, container: int, node: int) -> int:
    """The child of a container that the node is or is in."""
    while net.nodes[node].parent != container:
        node = net.nodes[node].parent
    return node
