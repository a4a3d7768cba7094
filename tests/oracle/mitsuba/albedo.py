"""Reference figures for rough metal: the light it returns from a white sky, by the angle at which it is seen.

usage: albedo.py     writes albedo.json
A metal that reflects everything (Fresnel's term 1) loses what its facets would pass on to each other. The distribution of
the facets and Smith's one-sided masking are Mitsuba's; both directions together are masked by the height-correlated form
1 / (1 + Lo + Li), with L = 1 / G1 - 1 (Heitz 2014). Over facets h seen from o, D G1(o) <o,h> / cos(o) is a density, so
    albedo(o) = integral of [G2 / G1(o)] D G1(o) <o,h> / cos(o) dh,    where i = 2 <o,h> h - o lies above the surface.
The integral over facets, not over directions of light, is another way than the renderer's tests take.
"""
import json, os
import numpy as np
import mitsuba as mi
mi.set_variant("llvm_ad_mono")

HERE = os.path.dirname(os.path.abspath(__file__))
COSINES = [.1, .25, .5, .75, 1.]
# Along and across, and the azimuth of the viewer from `along` (degrees).
PAIRS = [(a, a, 0) for a in (.05, .1, .2, .3, .5)] + [(.05, .3, t) for t in (0, 45, 90)] + [(.2, .6, t) for t in (0, 30, 90)]
ROWS = COLUMNS = 1000


def albedo(ax, ay, cosine, degrees):
    m = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, ax, ay, False)
    sine, turn = np.sqrt(1 - cosine * cosine), np.radians(degrees)
    o = np.array([sine * np.cos(turn), sine * np.sin(turn), cosine])
    # Facets by the slope they would have on a round lobe: tan = sqrt(s / (1 - s)), s even; stretched by the two alphas.
    s = (np.arange(ROWS) + .5) / ROWS
    t = (np.arange(COLUMNS) + .5) / COLUMNS * 2 * np.pi
    r = np.sqrt(s / (1 - s))[:, None]
    slope_x, slope_y = ax * r * np.cos(t), ay * r * np.sin(t)
    z = 1 / np.sqrt(1 + slope_x**2 + slope_y**2)
    h = np.stack([slope_x * z, slope_y * z, z])
    # dh = z^3 dslopes, and dslopes = ax ay r dr dt with r dr = ds / (2 (1 - s)^2).
    weight = z**3 * ax * ay / (2 * (1 - s[:, None])**2) / ROWS * (2 * np.pi / COLUMNS)
    dot = np.tensordot(o, h, 1)
    i = 2 * dot * h - o[:, None, None]
    vector = lambda v: mi.Vector3f(*[mi.Float(np.broadcast_to(c, (ROWS, COLUMNS)).ravel()) for c in v])
    facets, up = vector(h), (dot > 0) & (i[2] > 0)
    density = np.array(m.eval(facets)).reshape(ROWS, COLUMNS).astype(float)
    mask = lambda v: np.array(m.smith_g1(vector(v), facets)).reshape(ROWS, COLUMNS).astype(float)
    out, into = mask(o[:, None, None] * np.ones_like(h)), mask(i)
    with np.errstate(divide="ignore", invalid="ignore"):
        both = 1 / (1 / out + 1 / into - 1)
        term = np.where(up & (into > 0) & (out > 0), both * density * dot / cosine * weight, 0)
    return float(np.nansum(term))


if __name__ == "__main__":
    table = [dict(along=a, across=b, degrees=t, cosines=COSINES, albedo=[round(albedo(a, b, c, t), 5) for c in COSINES]) for a, b, t in PAIRS]
    lines = ",\n ".join(json.dumps(row) for row in table)
    open(f"{HERE}/albedo.json", "w").write(f"[\n {lines}\n]\n")
    print(lines)
