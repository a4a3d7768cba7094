"""Reference figures for a path tracer: seven small scenes, rendered by Mitsuba 3 with many samples.

usage: scenes.py [SCENE ...]     writes scenes.json, and adds to figures.json
Everything is in mm, z up, radiance linear. See the text in scenes.json ("conventions") for what is meant by each number.
"""
import json, math, os, re, sys, time
import numpy as np
import mitsuba as mi
mi.set_variant("llvm_ad_mono")
import drjit as dr

HERE = os.path.dirname(os.path.abspath(__file__))
W, H = 64, 48
CONVENTIONS = dict(
    camera="pinhole; the ray of image point (x, y), y downwards, goes from `at` along columns of `R` (right, up, back): d = R (x - 32, -(y - 24), -f). A pixel is the mean over its square (box filter), pixel (0, 0) top left",
    light="quad/annulus: diffuse emitter of constant radiance, one-sided: emits to the side its normal points to; absorbs all that meets it from either side. quad: the normal points from `at` to `aim`, the sides of length `width` are horizontal. environment: constant radiance from all directions",
    diffuse="Lambert, radiance albedo/pi * irradiance, both sides of a quad irrelevant: only fronts are seen",
    conductor="GGX (Trowbridge-Reitz), isotropic, alpha as given (not squared), Smith masking-shadowing in the separable form G1(i) G1(o), unpolarised Fresnel of n + i k in air, no multiple scattering between facets; reflectance factor 1",
    grooved="a conductor with alpha `along` its grooves and `across` them; on a pin they are circles about its axis, also on its top, on a sheet they run along its own x",
    sheet="a rectangle centred on the origin of its own frame, facing +z, before `turn` and `at`; nothing is seen of its back",
    depth="number of path segments after the camera ray's start, lamps seen directly being 1: depth 2 = direct light on what is seen (and lamps), 3 = one interreflection, ... all = without end (Russian roulette only)",
    boxes="axis-aligned before `turn` (degrees about x, then y, then z, about the origin) and `at`; stand on z = 0 of their own frame, centred in x and y",
    figures="mean over pixels of radiance, se its standard error from the scatter of independent passes; blocks: 3 rows (top to bottom) of 4 (left to right), 16 x 16 pixels each")


def camera(aim, distance, elevation, azimuth, f):
    e, a = np.radians((elevation, azimuth))
    back = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0])
    return dict(at=(np.array(aim) + back * distance).tolist(), R=np.stack([right, np.cross(back, right), back], 1).tolist(), f=f)


def lamp(at, aim, width, height):
    return dict(kind="quad", at=at, aim=aim, width=width, height=height)


floor = lambda albedo: dict(kind="floor", z=0, half=20000, material=dict(kind="diffuse", albedo=albedo))
diffuse = lambda a: dict(kind="diffuse", albedo=a)
steel = lambda alpha: dict(kind="conductor", n=2.5, k=3.3, alpha=alpha)
grooved = lambda along, across: dict(kind="grooved", n=2.5, k=3.3, along=along, across=across)
ring_cam = camera([0, 0, 8], 300, 70, -90, 180)
SCENES = dict(
    a=dict(title="diffuse sphere on a diffuse plane under a rectangular lamp", camera=camera([0, 0, 12], 300, 50, -90, 200),
           objects=[floor(.3), dict(kind="sphere", center=[0, 0, 15], d=30, material=diffuse(.7))],
           lights=[dict(lamp([-120, -40, 200], [0, 0, 0], 100, 80), radiance=10)]),
    b=dict(title="tilted rough steel plate under a rectangular lamp, nothing else", camera=camera([0, 0, 0], 300, 60, -90, 200),
           objects=[dict(kind="box", size=[60, 44, 4], at=[0, 0, 0], turn=[-12, 8, 0], material=steel(.2))],
           lights=[dict(lamp([-30, 150, 230], [0, 0, 0], 120, 90), radiance=4)]),
    c=dict(title="two diffuse boxes and a floor in a white environment", camera=camera([0, 0, 10], 300, 45, -60, 200),
           objects=[floor(.5), dict(kind="box", size=[24, 40, 30], at=[-16, 0, 0], turn=[0, 0, 0], material=diffuse(.8)),
                    dict(kind="box", size=[24, 30, 18], at=[14, 0, 0], turn=[0, 0, 15], material=diffuse(.6))],
           lights=[dict(kind="environment", radiance=1)]),
    d=dict(title="rough steel sphere over a diffuse plane in a white environment", camera=camera([0, 0, 14], 300, 50, -90, 200),
           objects=[floor(.4), dict(kind="sphere", center=[0, 0, 20], d=36, material=steel(.1))],
           lights=[dict(kind="environment", radiance=1)]),
    e=dict(title="ring lamp round the lens over a diffuse and a steel step", camera=ring_cam,
           objects=[floor(.1), dict(kind="box", size=[34, 40, 6], at=[-17, 0, 0], turn=[0, 0, 0], material=diffuse(.5)),
                    dict(kind="box", size=[34, 40, 14], at=[17, 0, 0], turn=[0, 0, 0], material=steel(.25))],
           lights=[dict(kind="annulus", center=ring_cam["at"], normal=(-np.array(ring_cam["R"])[:, 2]).tolist(), inner=45, outer=75, segments=256, radiance=10)]),
    f=dict(title="turned steel pin under two rectangular lamps, nothing else", camera=camera([0, 0, 14], 300, 45, -90, 300),
           objects=[dict(kind="pin", at=[0, 0, 0], d=40, h=24, material=grooved(.08, .22))],
           lights=[dict(lamp([-40, 210, 220], [0, 0, 20], 160, 120), radiance=4), dict(lamp([90, -260, 120], [0, 0, 10], 140, 160), radiance=6)]),
    g=dict(title="brushed steel sheet under a rectangular lamp, nothing else", camera=camera([0, 0, 0], 300, 60, -90, 200),
           objects=[dict(kind="sheet", size=[60, 44], at=[0, 0, 0], turn=[-12, 8, 30], material=grooved(.06, .25))],
           lights=[dict(lamp([-30, 150, 230], [0, 0, 0], 120, 90), radiance=4)]))


def bsdf(m, along="u"):
    if m["kind"] == "grooved":
        across = "v" if along == "u" else "u"
        return mi.load_dict({"type": "roughconductor", "eta": m["n"], "k": m["k"], f"alpha_{along}": m["along"], f"alpha_{across}": m["across"], "distribution": "ggx"})
    if m["kind"] == "diffuse":
        return mi.load_dict(dict(type="diffuse", reflectance=dict(type="uniform", value=m["albedo"])))
    return mi.load_dict(dict(type="roughconductor", eta=m["n"], k=m["k"], alpha=m["alpha"], distribution="ggx"))


def mesh(V, F, material=None, radiance=None):
    p = mi.Properties()
    if material:
        p["mesh_bsdf"] = bsdf(material)
    if radiance:
        p["mesh_bsdf"] = mi.load_dict(dict(type="diffuse", reflectance=dict(type="uniform", value=0.)))
        p["mesh_emitter"] = mi.load_dict(dict(type="area", radiance=dict(type="uniform", value=float(radiance))))
    m = mi.Mesh("m", len(V), len(F), props=p)
    t = mi.traverse(m)
    t["vertex_positions"], t["faces"] = np.asarray(V, np.float32).ravel(), np.asarray(F, np.uint32).ravel()
    t.update()
    return m


def rot(rx, ry, rz):
    T = mi.ScalarTransform4f()
    return np.array(T.rotate([0, 0, 1], rz).rotate([0, 1, 0], ry).rotate([1, 0, 0], rx).matrix)[:3, :3]


def build(s):
    out, triangles = dict(type="scene"), {}
    for i, o in enumerate(s["objects"]):
        if o["kind"] == "floor":
            q = o["half"]
            triangles[i] = [[[-q, -q, 0], [q, -q, 0], [q, q, 0]], [[-q, -q, 0], [q, q, 0], [-q, q, 0]]]
        elif o["kind"] == "box":
            x, y, z = np.array(o["size"]) / (2, 2, 1)
            V = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0], [-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]]) @ rot(*o["turn"]).T + o["at"]
            Q = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
            triangles[i] = [V[list(t)].tolist() for a, b, c, d in Q for t in ((a, b, c), (a, c, d))]
        if o["kind"] == "sphere":
            out[f"o{i}"] = mi.load_dict(dict(type="sphere", center=o["center"], radius=o["d"] / 2, bsdf=bsdf(o["material"])))
        elif o["kind"] == "pin":
            # Mitsuba's u runs round a cylinder, and outwards on a disk.
            T, at, r, h = mi.ScalarTransform4f(), np.array(o["at"], float), o["d"] / 2, o["h"]
            out[f"o{i}"] = mi.load_dict(dict(type="cylinder", p0=at.tolist(), p1=(at + [0, 0, h]).tolist(), radius=r, bsdf=bsdf(o["material"])))
            out[f"o{i}top"] = mi.load_dict(dict(type="disk", to_world=T.translate((at + [0, 0, h]).tolist()).scale(r), bsdf=bsdf(o["material"], "v")))
        elif o["kind"] == "sheet":
            T = mi.ScalarTransform4f()
            T = T.translate(o["at"]).rotate([0, 0, 1], o["turn"][2]).rotate([0, 1, 0], o["turn"][1]).rotate([1, 0, 0], o["turn"][0])
            out[f"o{i}"] = mi.load_dict(dict(type="rectangle", to_world=T.scale([o["size"][0] / 2, o["size"][1] / 2, 1]), bsdf=bsdf(o["material"])))
        else:
            V = np.array(triangles[i]).reshape(-1, 3)
            out[f"o{i}"] = mesh(V, np.arange(len(V)).reshape(-1, 3), o["material"])
    for i, l in enumerate(s["lights"]):
        if l["kind"] == "environment":
            out[f"l{i}"] = mi.load_dict(dict(type="constant", radiance=dict(type="uniform", value=float(l["radiance"]))))
        elif l["kind"] == "quad":
            at, aim = np.array(l["at"], float), np.array(l["aim"], float)
            w = (aim - at) / np.linalg.norm(aim - at)
            u = np.cross([0, 0, 1], w); u /= np.linalg.norm(u); v = np.cross(w, u)
            V = [at + sx * l["width"] / 2 * u + sy * l["height"] / 2 * v for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            out[f"l{i}"] = mesh(V, [[0, 1, 2], [0, 2, 3]], radiance=l["radiance"])
        else:
            w = np.array(l["normal"]); u = np.cross([0, 1, 0], w); u /= np.linalg.norm(u); v = np.cross(w, u)
            t = np.arange(l["segments"]) / l["segments"] * 2 * math.pi
            c = np.cos(t)[:, None] * u + np.sin(t)[:, None] * v
            n = l["segments"]
            V = np.concatenate([np.array(l["center"]) + r * c for r in (l["inner"], l["outer"])])
            F = [f for k in range(n) for f in ((k, n + k, n + (k + 1) % n), (k, n + (k + 1) % n, (k + 1) % n))]
            out[f"l{i}"] = mesh(V, F, radiance=l["radiance"])
    return mi.load_dict(out)


def render(scene, cam, depth, passes, spp):
    integrator = mi.load_dict(dict(type="path", max_depth=depth or -1, rr_depth=6))
    R, at, f = np.array(cam["R"]), list(map(float, cam["at"])), float(cam["f"])
    out = []
    with dr.suspend_grad():
        for p in range(passes):
            s = mi.load_dict(dict(type="independent")); s.seed(1 + p + 10007 * depth, W * H * spp)
            i = dr.arange(mi.UInt32, W * H * spp) // spp
            j = s.next_2d()
            x, y = mi.Float(i % W) + j.x - W / 2, H / 2 - (mi.Float(i // W) + j.y)
            d = [float(r[0]) * x + float(r[1]) * y - float(r[2]) * f for r in R]
            ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*at), dr.normalize(mi.Vector3f(*d))))
            out.append(np.array(dr.block_sum(integrator.sample(scene, s, ray)[0].x, spp)).reshape(H, W).astype(float) / spp)
    return np.array(out)


def figure(P):
    m = P.mean((1, 2))
    B = P.reshape(len(P), 3, 16, 4, 16).mean((2, 4))
    se = lambda x: x.std(0, ddof=1) / math.sqrt(len(P))
    return dict(mean=float(m.mean()), se=float(se(m)), blocks=B.mean(0).round(6).tolist(), blocks_se=se(B).round(7).tolist())


def write(name, data):
    """JSON with the innermost lists on one line each."""
    text = re.sub(r"\[[^][{}]*\]", lambda m: "[" + " ".join(m[0][1:-1].split()) + "]", json.dumps(data, indent=1))
    open(f"{HERE}/{name}", "w").write(text + "\n")


if __name__ == "__main__":
    built = {k: build(s) for k, s in SCENES.items()}
    write("scenes.json", dict(image=[W, H], conventions=CONVENTIONS, scenes=SCENES))
    path = f"{HERE}/figures.json"
    F = json.load(open(path)) if os.path.exists(path) else {}
    for k in sys.argv[1:] or SCENES:
        for depth in (2, 3, 0):
            t = time.time()
            P = render(built[k], SCENES[k]["camera"], depth, 32 if depth else 64, 256)
            F.setdefault(k, {})[str(depth) if depth else "all"] = g = dict(figure(P), samples_per_pixel=len(P) * 256)
            print(k, depth, f"{g['mean']:.5f} ± {100 * g['se'] / g['mean']:.3f} %  {time.time() - t:.0f} s", flush=True)
            write("figures.json", F)
