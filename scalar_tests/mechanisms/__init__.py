"""Joints with motors, stops and play."""
