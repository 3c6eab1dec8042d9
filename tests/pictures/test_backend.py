"""Detection of OpenGL, and the message about what to install if it is missing."""

import ctypes
from unittest.mock import MagicMock

import pytest

from superfacets_show.backend import RenderError, ensure_gl


@pytest.fixture
def installed(monkeypatch, no_display):
    """Return a function that hides all libraries except the given ones, on Linux."""

    def install(libraries):
        def load(name):
            if name not in libraries:
                raise OSError(f"{name}: cannot open shared object file")
            return libraries[name]

        monkeypatch.setattr(ctypes, "CDLL", load)

    return install


def egl_library(n_devices, n_startable):
    """Return a stand-in for libEGL, whose last device can be initialized."""

    def query(_, devices, count):
        handles = ctypes.cast(devices, ctypes.POINTER(ctypes.c_void_p))
        for device in range(n_devices):
            handles[device] = 100 + device
        ctypes.cast(count, ctypes.POINTER(ctypes.c_int))[0] = n_devices
        return 1

    pointer, integer = ctypes.c_void_p, ctypes.c_int
    functions = {
        b"eglQueryDevicesEXT": ctypes.CFUNCTYPE(integer, integer, pointer, pointer)(query),
        b"eglGetPlatformDisplayEXT": ctypes.CFUNCTYPE(pointer, integer, pointer, pointer)(
            lambda platform, device, _: device if platform == 0x313F else None
        ),
    }
    library = MagicMock()
    library.functions = functions  # keeps them alive
    library.eglGetProcAddress = lambda name: ctypes.cast(functions[name], pointer).value
    library.eglInitialize = lambda display, *_: display >= 100 + n_devices - n_startable
    return library


def x_library(display):
    library = MagicMock()
    library.XOpenDisplay.return_value = display
    return library


def glx_library(found):
    library = MagicMock()
    library.glXQueryExtension.return_value = found
    return library


def test_without_any_library_the_error_says_what_to_install(installed):
    installed({})
    with pytest.raises(RenderError, match=r"apt install libegl1 libgl1-mesa-dri .*libosmesa6"):
        ensure_gl()
    with pytest.raises(RenderError) as caught:
        ensure_gl()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("devices", [(0, 0), (1, 0), (3, 0)])
def test_an_egl_without_a_device_that_starts_does_not_count(installed, devices):
    installed({"libEGL.so.1": egl_library(*devices)})
    with pytest.raises(RenderError, match="no OpenGL was found"):
        ensure_gl()


@pytest.mark.parametrize("devices", [(1, 1), (3, 1)])
def test_an_egl_with_a_device_that_starts_is_used(installed, devices):
    installed({"libEGL.so.1": egl_library(*devices)})
    assert ensure_gl() == "vtkEGLRenderWindow"


def test_an_egl_that_cannot_list_devices_does_not_count(installed):
    library = MagicMock()
    library.eglGetProcAddress = lambda name: None
    installed({"libEGL.so.1": library})
    with pytest.raises(RenderError, match="no OpenGL was found"):
        ensure_gl()


@pytest.mark.parametrize("version", [6, 8])
def test_osmesa_is_used_where_there_is_nothing_else(installed, version):
    libraries = {f"libOSMesa.so.{version}": MagicMock()}
    installed(libraries)
    assert ensure_gl() == "vtkOSOpenGLRenderWindow"


def test_with_a_working_display_the_choice_is_left_to_vtk(installed, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":7")
    libraries = {"libX11.so.6": x_library(123), "libGL.so.1": glx_library(1)}
    installed(libraries)
    assert ensure_gl() is None
    libraries["libX11.so.6"].XCloseDisplay.assert_called_once_with(123)


@pytest.mark.parametrize(("display", "glx"), [(None, 1), (123, 0)])
def test_a_display_without_an_answer_or_opengl_does_not_count(installed, monkeypatch, display, glx):
    monkeypatch.setenv("DISPLAY", ":7")
    libraries = {"libX11.so.6": x_library(display), "libGL.so.1": glx_library(glx)}
    installed(libraries)
    with pytest.raises(RenderError, match="no OpenGL was found"):
        ensure_gl()


def test_a_window_that_the_user_has_set_is_not_replaced(installed, monkeypatch):
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    installed({"libEGL.so.1": egl_library(1, 1)})
    with pytest.raises(RenderError, match="VTK_DEFAULT_OPENGL_WINDOW=vtkOSOpenGLRenderWindow"):
        ensure_gl()


@pytest.mark.parametrize("no_display", ["darwin", "win32"], indirect=True)
def test_other_systems_always_have_opengl(no_display, installed):
    installed({})
    assert ensure_gl() is None
