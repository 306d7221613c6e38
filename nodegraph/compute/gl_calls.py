"""The OpenGL functions that are called past moderngl, through ctypes.

ctypes gives up the GIL during a call and moderngl does not: other threads would stand still while a draw is
waited for, a volume is uploaded or read back. `FramebufferTextureLayer`, which draws straight into a slice
of a 3-D texture, is not in moderngl at all.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from collections.abc import Callable
from typing import Any

from nodegraph.errors import DeviceMissing

FRAMEBUFFER = 0x8D40
COLOR_ATTACHMENT0 = 0x8CE0
TEXTURE_1D = 0x0DE0
TEXTURE_2D = 0x0DE1
TEXTURE_3D = 0x806F
TEXTURE0 = 0x84C0
TEXTURE_MAG_FILTER, TEXTURE_MIN_FILTER, TEXTURE_MAX_LEVEL = 0x2800, 0x2801, 0x813D
TEXTURE_WRAP_S, TEXTURE_WRAP_T, TEXTURE_WRAP_R = 0x2802, 0x2803, 0x8072
NEAREST, LINEAR, CLAMP_TO_EDGE = 0x2600, 0x2601, 0x812F
# Internal formats by kind of number and how many of them a texel has; a table of one axis may have three.
FORMATS = {
    "f4": {1: 0x822E, 2: 0x8230, 3: 0x8815, 4: 0x8814},
    "f2": {1: 0x822D, 2: 0x822F, 4: 0x881A},
    "u1 / 255": {1: 0x8229, 2: 0x822B, 4: 0x8058},
    "u2 / 65535": {1: 0x822A, 2: 0x822C, 4: 0x805B},
    "u1": {1: 0x8232, 2: 0x8238, 4: 0x8D7C},
    "u2": {1: 0x8234, 2: 0x823A, 4: 0x8D76},
    "u4": {1: 0x8236, 2: 0x823C, 4: 0x8D70},
    "i4": {1: 0x8235, 2: 0x823B, 4: 0x8D82},
}
TRIANGLES = 0x0004
CONTEXT_LOST = 0x0507
FRAMEBUFFER_COMPLETE = 0x8CD5
BLEND = 0x0BE2
DEPTH_ATTACHMENT = 0x8D00
DEPTH_CLAMP = 0x864F
LESS, ONE, ONE_MINUS_SRC_ALPHA = 0x0201, 1, 0x0303
FUNC_ADD, MIN, MAX = 0x8006, 0x8007, 0x8008
FRONT, BACK, CW = 0x0404, 0x0405, 0x0900
COLOR, DEPTH = 0x1800, 0x1801
CULL_FACE = 0x0B44
DEPTH_TEST = 0x0B71
SCISSOR_TEST = 0x0C11
UNPACK_ALIGNMENT = 0x0CF5
PACK_ALIGNMENT = 0x0D05

_INT, _UINT, _POINTER = ctypes.c_int, ctypes.c_uint, ctypes.c_void_p


class Calls:
    """Typed entry points of the current context's OpenGL; every call releases the GIL."""

    def __init__(self) -> None:
        address, prototype = _loader()

        def bind(name: str, *arguments: Any, result: Any = None) -> Callable[..., Any]:
            found = address(name)
            if not found:
                raise DeviceMissing(f"gl: this OpenGL library offers no {name}")
            function: Callable[..., Any] = prototype(result, *arguments)(found)
            return function

        self.finish = bind("glFinish")
        self.get_error = bind("glGetError", result=_UINT)
        self.active_texture = bind("glActiveTexture", _UINT)
        self.bind_texture = bind("glBindTexture", _UINT, _UINT)
        self.gen_textures = bind("glGenTextures", _INT, _POINTER)
        self.delete_textures = bind("glDeleteTextures", _INT, _POINTER)
        self.tex_parameter = bind("glTexParameteri", _UINT, _UINT, _INT)
        self.tex_image_3d = bind("glTexImage3D", _UINT, *[_INT] * 6, _UINT, _UINT, _POINTER)
        self.tex_image_2d = bind("glTexImage2D", _UINT, *[_INT] * 5, _UINT, _UINT, _POINTER)
        self.tex_image_1d = bind("glTexImage1D", _UINT, *[_INT] * 4, _UINT, _UINT, _POINTER)
        self.tex_sub_image_1d = bind("glTexSubImage1D", _UINT, *[_INT] * 3, _UINT, _UINT, _POINTER)
        self.pixel_store = bind("glPixelStorei", _UINT, _INT)
        self.tex_sub_image_2d = bind("glTexSubImage2D", _UINT, *[_INT] * 5, _UINT, _UINT, _POINTER)
        self.tex_sub_image_3d = bind("glTexSubImage3D", _UINT, *[_INT] * 7, _UINT, _UINT, _POINTER)
        self.get_tex_image = bind("glGetTexImage", _UINT, _INT, _UINT, _UINT, _POINTER)
        self.framebuffer_texture = bind("glFramebufferTexture2D", _UINT, _UINT, _UINT, _UINT, _INT)
        self.framebuffer_layer = bind("glFramebufferTextureLayer", _UINT, _UINT, _UINT, _INT, _INT)
        self.gen_framebuffers = bind("glGenFramebuffers", _INT, _POINTER)
        self.delete_framebuffers = bind("glDeleteFramebuffers", _INT, _POINTER)
        self.bind_framebuffer = bind("glBindFramebuffer", _UINT, _UINT)
        self.framebuffer_status = bind("glCheckFramebufferStatus", _UINT, result=_UINT)
        self.draw_buffers = bind("glDrawBuffers", _INT, _POINTER)
        self.viewport = bind("glViewport", _INT, _INT, _INT, _INT)
        self.scissor = bind("glScissor", _INT, _INT, _INT, _INT)
        self.enable = bind("glEnable", _UINT)
        self.disable = bind("glDisable", _UINT)
        self.depth_func = bind("glDepthFunc", _UINT)
        self.blend_equation = bind("glBlendEquation", _UINT)
        self.blend_func = bind("glBlendFunc", _UINT, _UINT)
        self.cull_face = bind("glCullFace", _UINT)
        self.front_face = bind("glFrontFace", _UINT)
        self.clear_float = bind("glClearBufferfv", _UINT, _INT, _POINTER)
        self.clear_int = bind("glClearBufferiv", _UINT, _INT, _POINTER)
        self.clear_uint = bind("glClearBufferuiv", _UINT, _INT, _POINTER)
        self.gen_vertex_arrays = bind("glGenVertexArrays", _INT, _POINTER)
        self.delete_vertex_arrays = bind("glDeleteVertexArrays", _INT, _POINTER)
        self.draw_arrays = bind("glDrawArrays", _UINT, _INT, _INT)
        self.use_program = bind("glUseProgram", _UINT)
        self.bind_vertex_array = bind("glBindVertexArray", _UINT)


def _loader() -> tuple[Callable[[str], int | None], Any]:
    """Return how an OpenGL function is looked up on this platform, and how it is called."""
    if sys.platform == "win32":
        library = ctypes.WinDLL("opengl32")
        library.wglGetProcAddress.restype = _POINTER
        library.wglGetProcAddress.argtypes = [ctypes.c_char_p]

        def windows(name: str) -> int | None:
            # wglGetProcAddress knows only what came after OpenGL 1.1; the rest is exported.
            found: int | None = library.wglGetProcAddress(name.encode())
            if found in (None, 0, 1, 2, 3):
                exported = getattr(library, name, None)
                found = None if exported is None else ctypes.cast(exported, _POINTER).value
            return found

        return windows, ctypes.WINFUNCTYPE
    if sys.platform == "darwin":
        framework = ctypes.CDLL("/System/Library/Frameworks/OpenGL.framework/OpenGL")

        def mac(name: str) -> int | None:
            exported = getattr(framework, name, None)
            return None if exported is None else ctypes.cast(exported, _POINTER).value

        return mac, ctypes.CFUNCTYPE
    for stem, getter in (("EGL", "eglGetProcAddress"), ("GL", "glXGetProcAddressARB")):
        try:
            library = ctypes.CDLL(ctypes.util.find_library(stem) or f"lib{stem}.so.1")
        except OSError:
            continue
        lookup = getattr(library, getter, None)
        if lookup is not None:
            lookup.restype, lookup.argtypes = _POINTER, [ctypes.c_char_p]

            def linux(name: str, lookup: Any = lookup) -> int | None:
                found: int | None = lookup(name.encode())
                return found

            return linux, ctypes.CFUNCTYPE
    raise DeviceMissing("gl: no OpenGL library was found; install the packages libegl1 and libgl1")
