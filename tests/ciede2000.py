"""Color differences for tests."""

import numpy as np


def lab(colors):
    """Convert sRGB colors, 0 to 255, shape (..., 3), to CIELAB (white point D65)."""
    values = np.asarray(colors, float) / 255
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
              [0.0193339, 0.1191920, 0.9503041]]  # fmt: skip
    xyz = linear @ np.transpose(to_xyz) / [0.95047, 1, 1.08883]
    x, y, z = np.moveaxis(
        np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116), -1, 0
    )
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def ciede2000(one, other):
    """Return the CIEDE2000 difference of CIELAB colors (Sharma, Wu and Dalal, 2005)."""
    light, red, yellow = np.moveaxis(np.stack(np.broadcast_arrays(one, other)), -1, 0)
    seventh = np.hypot(red, yellow).mean(axis=0) ** 7
    red = red * (1.5 - 0.5 * np.sqrt(seventh / (seventh + 25.0**7)))
    chroma, hue = np.hypot(red, yellow), np.degrees(np.arctan2(yellow, red)) % 360
    has_hue = (chroma > 0).all(axis=0)
    turn = np.where(has_hue, (hue[1] - hue[0] + 180) % 360 - 180, 0)
    mean_hue = np.where(has_hue, (hue[0] + turn / 2) % 360, hue.sum(axis=0))
    mean_light, mean_chroma = light.mean(axis=0), chroma.mean(axis=0)

    def cosine(factor, shift):
        return np.cos(np.radians(factor * mean_hue + shift))

    t = 1 - 0.17 * cosine(1, -30) + 0.24 * cosine(2, 0) + 0.32 * cosine(3, 6) - 0.2 * cosine(4, -63)
    square = (mean_light - 50) ** 2
    of_light = (light[1] - light[0]) / (1 + 0.015 * square / np.sqrt(20 + square))
    of_chroma = (chroma[1] - chroma[0]) / (1 + 0.045 * mean_chroma)
    hue = 2 * np.sqrt(chroma.prod(axis=0)) * np.sin(np.radians(turn / 2))
    of_hue = hue / (1 + 0.015 * mean_chroma * t)
    angle = np.radians(60 * np.exp(-(((mean_hue - 275) / 25) ** 2)))
    rotation = -2 * np.sin(angle) * np.sqrt(mean_chroma**7 / (mean_chroma**7 + 25.0**7))
    return np.sqrt(of_light**2 + of_chroma**2 + of_hue**2 + rotation * of_chroma * of_hue)
