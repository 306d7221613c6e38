"""VTK's two ray-casters, called as their authors mean them to be called, with everything switched off that would
make the step another than the one that is asked for."""

from __future__ import annotations

import ctypes
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import Camera
from tests.benchmarks.peers.scenes import AMBIENT, DIFFUSE, Scene

KINDS = ("gpu", "fixed-point")
BITS = {"gpu": 8, "fixed-point": 15}
"""Of a channel of a picture."""
KEYS = 2048
"""Nodes of VTK's functions: it interpolates opacities, we extinctions, so the keys alone would not mean the same.
Evenly spaced, because VTK sizes its tables by the two that lie closest together."""


class Vtk:
    """A scene in a window of VTK without a display.

    kind:    "gpu", `vtkOpenGLGPUVolumeRayCastMapper`, or "fixed-point", `vtkFixedPointVolumeRayCastMapper`.
    threads: of the fixed-point mapper. OpenGL takes what llvmpipe takes.
    """

    def __init__(self, scene: Scene, kind: str, threads: int | None = None) -> None:
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import vtkmodules.vtkRenderingOpenGL2
        import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  registers the mappers
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkVolume

        self.scene, self.kind = scene, kind
        self.mapper = _mapper(kind, threads or os.cpu_count() or 1)
        self.mapper.SetInputData(_image(scene))
        volume = vtkVolume()
        volume.SetMapper(self.mapper)
        volume.SetProperty(_property(scene))
        self.renderer = vtkRenderer()
        self.renderer.SetBackground(0.0, 0.0, 0.0)
        self.renderer.AddVolume(volume)
        self.window = vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(*scene.size)
        self.window.AddRenderer(self.renderer)

    def frame(self, step: float, camera: Camera | None = None) -> None:
        """Render with samples ``step`` voxels apart, and wait until the picture is there, in VTK's window."""
        length = self.scene.step_length(step)
        if self.mapper.GetSampleDistance() != np.float32(length):
            self.mapper.SetSampleDistance(length)
        _aim(self.renderer.GetActiveCamera(), camera or self.scene.camera)
        self.window.Render()
        self.window.WaitForCompletion()

    def picture(self, step: float, camera: Camera | None = None) -> NDArray[np.float64]:
        """The same, read back: linear RGB over black, (h, w, 3).

        The GPU mapper's lies in the window, with 8 bits a channel. The fixed-point mapper's is taken from the mapper,
        with its own 15 bits: on its way to the window it is stretched by a pixel.
        """
        if self.kind == "fixed-point":
            self.frame(step, camera)
            return _stored(self.mapper.GetRayCastImage())
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        self.frame(step, camera)
        width, height = self.scene.size
        pixels = vtkUnsignedCharArray()
        self.window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
        rows = vtk_to_numpy(pixels).reshape(height, width, 4)[::-1, :, :3]
        return np.asarray(rows, np.float64) / 255.0

    def close(self) -> None:
        """Let go of the window and its context."""
        self.window.Finalize()


def _stored(image: Any) -> NDArray[np.float64]:
    """The picture that the fixed-point mapper made, whose address is all that Python sees of it."""
    address = int(image.GetImage().removeprefix("_").removesuffix("_p_void"), 16)
    memory, (width, height) = image.GetImageMemorySize(), image.GetImageInUseSize()
    stored = np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(ctypes.c_uint16)), (memory[1], memory[0], 4))
    # Only what the volume's box covers is there; row 0 is the lowest.
    (left, low), (columns, rows) = image.GetImageOrigin(), image.GetImageViewportSize()
    picture = np.zeros((rows, columns, 3))
    picture[low : low + height, left : left + width] = stored[:height, :width, :3] / 32767.0
    return picture[::-1]


def version() -> str:
    """VTK's version."""
    from importlib.metadata import version as installed

    return installed("vtk")


def _mapper(kind: str, threads: int) -> Any:
    if kind == "gpu":
        from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper

        mapper = vtkOpenGLGPUVolumeRayCastMapper()
        mapper.SetUseJittering(0)
    else:
        from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

        mapper = vtkFixedPointVolumeRayCastMapper()
        mapper.SetNumberOfThreads(threads)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetBlendModeToComposite()
    return mapper


def _image(scene: Scene) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    image.SetDimensions(*scene.volume.dims)
    image.SetSpacing(*scene.volume.spacing.tolist())
    image.SetOrigin(*scene.volume.index_to_world[:3, 3].tolist())
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(scene.volume.data).ravel(), deep=True))
    return image


def _property(scene: Scene) -> Any:
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolumeProperty

    function = scene.transfer_function
    values = np.linspace(*function.domain, KEYS)
    colors, opacities = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for value, (red, green, blue, extinction) in zip(values, function.evaluate(values), strict=True):
        colors.AddRGBPoint(value, red, green, blue)
        opacities.AddPoint(value, -np.expm1(-extinction))
    material = vtkVolumeProperty()
    material.SetColor(colors)
    material.SetScalarOpacity(opacities)
    material.SetScalarOpacityUnitDistance(1.0)  # opacities are per millimetre
    material.SetInterpolationTypeToLinear()
    if scene.lit:
        material.ShadeOn()
        material.SetAmbient(AMBIENT)
        material.SetDiffuse(DIFFUSE)
        material.SetSpecular(0.0)
    return material


def _aim(target: Any, camera: Camera) -> None:
    target.SetPosition(*camera.eye)
    target.SetFocalPoint(*camera.target)
    target.SetViewUp(*camera.up)
    target.SetViewAngle(camera.field_of_view)
    distance = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
    target.SetClippingRange(0.01 * distance, 4.0 * distance)
