"""Load the drawing libraries: VTK with OpenGL, and Pillow."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import sys
from collections.abc import Iterator, Mapping
from types import SimpleNamespace
from typing import Any

from superfacets import MissingExtraError, RenderError
from superfacets.kit import import_extra

# Suppresses messages on stderr that Mesa's EGL writes if a device does not start.
_QUIET_EGL = {"EGL_LOG_LEVEL": "fatal"}


@contextlib.contextmanager
def quiet_vtk() -> Iterator[None]:
    """Let VTK draw off screen and without messages inside a ``with`` block.

    At the end of the block, the settings of VTK and the environment variables are restored. Raises
    a RenderError if there is no OpenGL.
    """
    window = ensure_gl()
    wanted = dict(_QUIET_EGL)
    if window is not None:
        wanted["VTK_DEFAULT_OPENGL_WINDOW"] = window
    from vtkmodules.vtkCommonCore import vtkObject

    shows_warnings = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        with _environment(wanted):
            yield
    finally:
        vtkObject.SetGlobalWarningDisplay(shows_warnings)


@contextlib.contextmanager
def _environment(wanted: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables inside a ``with`` block, except variables that are already set."""
    missing = [name for name in wanted if name not in os.environ]
    os.environ.update({name: wanted[name] for name in missing})
    try:
        yield
    finally:
        for name in missing:
            os.environ.pop(name, None)


def ensure_gl() -> str | None:
    """Return the name of the window class that VTK must use, or None for the default class of VTK.

    VTK terminates the process if it finds no OpenGL, so this function looks for OpenGL first. A
    display is preferred to EGL, because it is not safe to use EGL in a process that has windows
    open on a display. If neither a display, EGL nor OSMesa is available, raises a RenderError whose
    message says what to install. On systems other than Linux, always returns None.
    """
    if not sys.platform.startswith("linux"):
        return None
    probes = {
        "vtkXOpenGLRenderWindow": _has_display,
        "vtkEGLRenderWindow": _has_egl,
        "vtkOSOpenGLRenderWindow": _has_osmesa,
    }
    chosen = os.environ.get("VTK_DEFAULT_OPENGL_WINDOW", "")
    for window in [chosen] if chosen in probes else probes:
        with _environment(_QUIET_EGL):
            usable = probes[window]()
        if usable:
            return None if window == "vtkXOpenGLRenderWindow" else window
    setting = f" for VTK_DEFAULT_OPENGL_WINDOW={chosen}" if chosen in probes else ""
    raise RenderError(
        f"no OpenGL was found{setting}: apt install libegl1 libgl1-mesa-dri (or libosmesa6)"
    )


def _load_library(name: str) -> Any:
    """Load a shared library; return None if the library cannot be loaded."""
    try:
        return ctypes.CDLL(name)
    except OSError:
        return None


def _has_display() -> bool:
    """Return whether there is an X server that supports OpenGL."""
    x11, glx = _load_library("libX11.so.6"), _load_library("libGL.so.1")
    if not os.environ.get("DISPLAY") or x11 is None or glx is None:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    glx.glXQueryExtension.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return False
    answer = (ctypes.c_int * 2)()
    found = glx.glXQueryExtension(display, ctypes.byref(answer, 0), ctypes.byref(answer, 4))
    x11.XCloseDisplay(display)
    return bool(found)


def _has_egl() -> bool:
    """Return whether EGL has a device that can be initialized. VTK needs such a device."""
    # EGL has no devices if no vendor library is installed, and cannot initialize its devices if no
    # driver is installed. An initialized device is not closed, because other code may be using it.
    egl = _load_library("libEGL.so.1")
    if egl is None:
        return False
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    egl.eglGetProcAddress.argtypes = [ctypes.c_char_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
    query_address = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    display_address = egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not query_address or not display_address:
        return False
    pointer, integer = ctypes.c_void_p, ctypes.c_int
    query = ctypes.CFUNCTYPE(integer, integer, pointer, pointer)(query_address)
    get_display = ctypes.CFUNCTYPE(pointer, integer, pointer, pointer)(display_address)
    devices, n_devices = (pointer * 16)(), integer(0)
    if not query(len(devices), devices, ctypes.byref(n_devices)):
        return False
    platform_device = 0x313F  # EGL_PLATFORM_DEVICE_EXT
    displays = [get_display(platform_device, device, None) for device in devices[: n_devices.value]]
    return any(display and egl.eglInitialize(display, None, None) for display in displays)


def _has_osmesa() -> bool:
    """Return whether Mesa's software renderer is installed under a name that VTK expects."""
    return any(_load_library(f"libOSMesa.so.{version}") is not None for version in (8, 6))


# VTK modules to import. vtkRenderingOpenGL2 registers the classes that create windows.
_VTK_MODULES = (
    "vtkCommonCore", "vtkCommonDataModel", "vtkFiltersCore", "vtkRenderingCore",
    "vtkRenderingOpenGL2", "util.numpy_support",
)  # fmt: skip


def import_vtk() -> Any:
    """Return the members of all modules in `_VTK_MODULES` as one namespace, without loading OpenGL.

    Raises a MissingExtraError if VTK is not installed, and a RenderError if VTK cannot be loaded.
    """
    members: dict[str, Any] = {}
    try:
        for name in _VTK_MODULES:
            members |= vars(importlib.import_module(f"vtkmodules.{name}"))
    except ModuleNotFoundError:
        raise MissingExtraError("rendering", "viz") from None
    except ImportError as error:
        raise RenderError(f"VTK cannot be loaded: {error}") from error
    return SimpleNamespace(**members)


def import_pillow(module: str) -> Any:
    """Return a module of Pillow, or raise a MissingExtraError if Pillow is not installed."""
    return import_extra(f"PIL.{module}", "rendering", "viz")
