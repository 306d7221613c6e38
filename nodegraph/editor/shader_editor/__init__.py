"""Kernels as text: edited, saved and seen at once in the picture."""

from nodegraph.editor.shader_editor.panel import ShaderPanel

__all__ = ["ShaderPanel"]
