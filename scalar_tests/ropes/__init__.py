"""Chains, ropes, cables and wires."""
