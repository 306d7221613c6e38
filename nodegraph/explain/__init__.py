"""Say what a plan would do and why, what made a node dirty, and what a scene required, as text."""

from __future__ import annotations

from nodegraph.explain.differences import changes
from nodegraph.explain.fate import LastRun
from nodegraph.explain.planned import explain, states, why
from nodegraph.explain.scenes import Scene, SceneNode, scene

__all__ = ["LastRun", "Scene", "SceneNode", "changes", "explain", "scene", "states", "why"]
